% SPDX-License-Identifier: Apache-2.0
function results = run(config, varargin)
    % Estimates a whole recording, the files of the config's section data, as mhe-run does: the same bits.
    %
    %   results = myohorizon.run('arm.yaml', 'horizon.window', 5);
    %   plot(results.time, results.force(:, strcmp(results.muscle_names, 'BRA')))
    %
    % config and pairs as of Estimator. A struct: time [n x 1] s; q, qdot [n x n_coordinates] rad, rad/s (m, m/s);
    % activation, excitation [n x n_muscles]; force [n x n_muscles] N; moment [n x n_coordinates] N m; residual N m;
    % markers [n x 3 n_markers] m (x, y, z of the first, ...); quality [n x 6], its columns quality_names; names;
    % verdict 'yes', 'doubtful' or 'no'; findings, a struct array of weight, text, remedy; text, the findings as mhe-run
    % prints them; rmse in SI units where the truth is known; name, config, dropped.
    given = myohorizon.internal.configuration(config, varargin);
    results = mhe_gateway('run', given{:});
end
