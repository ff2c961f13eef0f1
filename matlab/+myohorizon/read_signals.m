% SPDX-License-Identifier: Apache-2.0
function table = read_signals(file)
    % Signals of a .sto, .mot, .c3d (analog) or .xdf (EMG): time (s), values [n x n_labels] as in the file, labels, rate (Hz), in_degrees, warnings.
    table = mhe_gateway('read', 'signals', file);
end
