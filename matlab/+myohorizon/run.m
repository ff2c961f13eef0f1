% SPDX-License-Identifier: Apache-2.0
function results = run(config, varargin)
    % Estimates a whole recording, the files of the config's section data, as mhe-run does: the same bits.
    %
    %   results = myohorizon.run('arm.yaml', 'horizon.window', 5);
    %   plot(results.time, results.force(:, strcmp(results.muscle_names, 'BRA')))
    %
    % A struct: time [n x 1] s; q, qdot [n x n_coordinates] rad, rad/s (m, m/s); activation, excitation [n x n_muscles];
    % force [n x n_muscles] N; moment [n x n_coordinates] N m; markers [n x 3 n_markers] m (x, y, z of the first, ...);
    % names; verdict 'yes', 'doubtful' or 'no'; text, the findings; rmse in SI units where the truth is known.
    results = mhe_gateway('run', config, myohorizon.assignments(varargin));
end
