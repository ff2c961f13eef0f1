% SPDX-License-Identifier: Apache-2.0
function table = read_trc(file)
    % Markers of a .trc: time [n x 1] (s), values [n x 3 n_labels] (m; x, y, z of the first, ...), labels, unit, rate (Hz),
    % warnings (what of the file was repaired or skipped).
    table = mhe_gateway('read', 'markers', file);
end
