% SPDX-License-Identifier: Apache-2.0
function found = calibrate(config, out, varargin)
    % Estimates strengths, lengths, EMG gains and marker places of a person from recordings, as mhe-calibrate does.
    %
    % config: path of a config of mhe-run with the section calibrate; out: folder of the results; behind it keys and values.
    % A struct (docs/calibrate.md): outcome, 'converged' or why not; parameters, a struct array of parameter, before, after,
    % sd, prior_sd, lower, upper, verdict; recordings; model and config, the paths of what was calibrated.
    [status, message] = myohorizon.internal.run_program('mhe-calibrate', {config, '--out', out, '--quiet'}, varargin);
    if status ~= 0
        error('myohorizon:error', 'mhe-calibrate ended with status %d: %s', status, message);
    end
    told = jsondecode(fileread(fullfile(out, 'calibration.json')));
    found = struct('outcome', told.outcome, 'parameters', myohorizon.internal.read_csv(fullfile(out, 'parameters.csv'), {'parameter', 'verdict'}), ...
                   'model', fullfile(out, 'calibrated.osim'), 'config', fullfile(out, 'calibrated.yaml'));
    found.recordings = told.recordings;
end
