% SPDX-License-Identifier: Apache-2.0
function rows = batch(config, trials, out, varargin)
    % Runs the trials of a session over the processors, as mhe-run --batch does, and goes on where it was.
    %
    %   rows = myohorizon.batch('shared.yaml', struct('walk1', struct('data', struct('markers', 'walk1.trc'))), 'out');
    %
    % config: path of the shared config; '' where the trials name theirs. trials: a struct, a field a trial, of structs with
    % keys of the config; or the path of a table or folder (docs/batch.md). out: folder of the results. Behind it keys and
    % values for all trials, and 'workers', processes (default: as many as processors).
    %
    % A struct array, a trial each: trial, usable ('yes', 'doubtful', 'no', 'failed'), exit_status, estimates, converged,
    % solve_ms, marker_rms_mm, emg_rms, rmse_q_deg, rmse_force_n (NaN where there is none), reason. A trial that fails is
    % no error; what is wrong with the list or its configs is one.
    [pairs, own] = myohorizon.internal.take(varargin, {'workers'}, {[]});
    if isstruct(trials)
        if ~exist(out, 'dir'), mkdir(out); end
        trials = write_trials(trials, fullfile(out, 'trials.csv'));
    end
    words = [{config}, {'--batch', trials, '--out', out, '--quiet'}];
    words = words(~cellfun(@isempty, words));
    if ~isempty(own{1})
        words = [words, {'--workers', sprintf('%d', own{1})}];
    end
    [status, message] = myohorizon.internal.run_program('mhe-run', words, pairs);
    table = fullfile(out, 'batch.csv');
    if ~exist(table, 'file') || ~isempty(strfind(message, 'interrupted')) %#ok<STREMP>
        error('myohorizon:error', 'mhe-run ended with status %d: %s', status, message);
    end
    rows = myohorizon.internal.read_csv(table, {'trial', 'usable', 'reason'});
end

function path = write_trials(trials, path)
    % {"name", key, ...} a row; values that are files of the working directory are named as a whole path.
    names = fieldnames(trials);
    flat = cell(size(names));
    keys = cell(1, 0);
    for i = 1:numel(names)
        flat{i} = flattened(trials.(names{i}), '');
        keys = [keys, setdiff(flat{i}(:, 1)', keys, 'stable')]; %#ok<AGROW>
    end
    file = fopen(path, 'w');
    if file < 0
        error('myohorizon:error', '%s: cannot be written', path);
    end
    fprintf(file, '%s\n', strjoin(cellfun(@quoted, [{'name'}, keys], 'UniformOutput', false), ','));
    for i = 1:numel(names)
        cells = cell(1, numel(keys));
        cells(:) = {''};
        [~, at] = ismember(flat{i}(:, 1)', keys);
        cells(at) = flat{i}(:, 2)';
        fprintf(file, '%s\n', strjoin(cellfun(@quoted, [names(i), cells], 'UniformOutput', false), ','));
    end
    fclose(file);
end

function rows = flattened(values, prefix)
    % {'data.markers', 'walk1.trc'; ...} of struct('data', struct('markers', 'walk1.trc')).
    rows = cell(0, 2);
    keys = fieldnames(values);
    for i = 1:numel(keys)
        value = values.(keys{i});
        if isstruct(value) && isscalar(value)
            rows = [rows; flattened(value, [prefix keys{i} '.'])]; %#ok<AGROW>
            continue
        end
        if ~ischar(value)
            value = jsonencode(value);
        elseif exist(fullfile(pwd(), value), 'file')
            value = fullfile(pwd(), value);
        end
        rows(end + 1, :) = {[prefix keys{i}], value}; %#ok<AGROW>
    end
end

function text = quoted(text)
    text = ['"' strrep(text, '"', '""') '"'];
end
