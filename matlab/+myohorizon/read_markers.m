% SPDX-License-Identifier: Apache-2.0
function table = read_markers(file)
    % Markers of a .trc, .c3d or .xdf: time (s), values [n x 3 n_labels] (m), labels, rate (Hz), warnings.
    table = mhe_gateway('read', 'markers', file);
end
