% SPDX-License-Identifier: Apache-2.0
function [markers, signals] = read_xdf(file)
    % Markers (m, as of read_trc) and EMG (as of read_sto) of an .xdf of Lab Streaming Layer; [] for what it has not.
    [markers, signals] = myohorizon.internal.read_both(file);
end
