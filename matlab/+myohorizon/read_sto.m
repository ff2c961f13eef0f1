% SPDX-License-Identifier: Apache-2.0
function table = read_sto(file)
    % Signals of a .sto, .mot or .csv: time [n x 1] (s), values [n x n_labels] as in the file, labels, rate (Hz), in_degrees
    % (the header says so), warnings.
    table = mhe_gateway('read', 'signals', file);
end
