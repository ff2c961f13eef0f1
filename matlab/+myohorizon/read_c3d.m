% SPDX-License-Identifier: Apache-2.0
function [markers, signals] = read_c3d(file)
    % Markers (m, as of read_trc) and analog signals (as of read_sto) of a .c3d; [] for what it has not.
    [markers, signals] = myohorizon.internal.read_both(file);
end
