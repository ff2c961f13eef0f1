% SPDX-License-Identifier: Apache-2.0
1; % a script file: functions follow

function holds(condition, varargin)
    if ~condition
        error(['FAILED: ' sprintf(varargin{:})]);
    end
end

% The error of a function has this identifier, and says so.
function refused(id, text, work)
    try
        work();
    catch caught
        holds(strcmp(caught.identifier, ['myohorizon:' id]), '%s: %s', caught.identifier, caught.message);
        holds(isempty(text) || ~isempty(strfind(caught.message, text)), '%s', caught.message);
        return
    end
    error('FAILED: nothing was refused: %s', text);
end

function test_myohorizon(source, work)
    warning('off', 'Octave:language-extension');
    demo = fullfile(source, 'models', 'arm19', 'demo.yaml');
    of_a_recording(demo, work);
    of_frames(source, demo);
    of_wrong_frames(demo);
    of_wrong_calls(demo);
    of_configs(source, demo, work);
    of_raw_emg(source);
    of_files(source);
    of_models(source);
    of_a_session(source, demo, work);
    of_a_person(source, work);
    of_streams(source, work);
    many(demo);
    disp('all as it should be');
end

% A whole recording: the bits that mhe-run has written.
function of_a_recording(demo, work)
    results = myohorizon.run(demo);
    holds(strcmp(results.verdict, 'yes') && results.rmse.force < 5 && isempty(results.findings), 'verdict %s', results.verdict);
    written = load(fullfile(work, 'demo', 'results.mat'));
    holds(isequal(written.forces.labels(:), results.muscle_names(:)), 'labels');
    holds(isequal(written.forces.time(:), results.time(:)) && numel(results.time) > 80, 'times');
    holds(isequal(written.forces.data, results.force), 'forces');
    holds(isequal(written.estimates.data, [results.q, results.qdot, results.activation, results.excitation]), 'states');
    at = strcmp(results.quality_names, 'status');
    holds(any(at) && all(ismember(results.quality(:, at), 0:4)), 'quality');
    holds(strcmp(results.name, 'demo') && ~isempty(strfind(results.config, 'window: 7')) && isempty(results.dropped), 'rest');
    [verdict, findings] = myohorizon.check_config(demo);
    holds(strcmp(verdict, 'yes') && isempty(findings), 'check %s', verdict);
    [verdict, findings] = myohorizon.check_config(demo, 'data.transform', struct('rotate', 'x-90'));
    holds(~strcmp(verdict, 'yes') && ~isempty(findings(1).remedy) && ~strcmp(findings(1).weight, 'note'), 'turned: %s', verdict);
end

% Frames of the demo in the order of the estimator's names.
function [t, markers, emg] = frames_of(source, e)
    table = myohorizon.read_trc(fullfile(source, 'models', 'arm19', 'demo_markers.trc'));
    signals = myohorizon.read_sto(fullfile(source, 'models', 'arm19', 'demo_emg.sto'));
    [~, of_marker] = ismember(e.marker_names, table.labels);
    [~, of_muscle] = ismember(e.muscle_names, signals.labels);
    t = table.time;
    markers = permute(reshape(table.values', 3, [], numel(t)), [2 1 3])(of_marker, :, :);
    emg = signals.values(:, of_muscle)';
end

% Frame by frame: the bits of the whole recording, and what was tracked.
function of_frames(source, demo)
    rti = {'solver.plugin', 'mhe.solver.rti', 'output.uncertainty', true};
    results = myohorizon.run(demo, rti{:});
    e = myohorizon.Estimator(demo, rti{:});
    holds(strcmp(e.info().phase, 'empty') && ~e.closed(), 'phase');
    [t, markers, emg] = frames_of(source, e);
    n = 0;
    for k = 1:numel(t)
        estimate = e.push(t(k), markers(:, :, k), emg(:, k));
        if isempty(estimate)
            holds(isempty(fieldnames(e.tracked())), 'tracked without an estimate');
            continue
        end
        n = n + 1;
        tracked = e.tracked();
        e.prepare();
        holds(isequal(estimate.force', results.force(n, :)), 'forces of estimate %d', n);
        holds(isequal(reshape(estimate.markers', 1, []), results.markers(n, :)), 'markers of estimate %d', n);
    end
    now = e.info();
    holds(n == numel(results.time) && strcmp(now.phase, 'running'), '%d estimates', n);
    holds(strcmp(estimate.status, 'ok') && numel(estimate.force_sd) == 19 && all(estimate.force_sd > 0), 'deviations');
    holds(strcmp(tracked.markers.columns{1}, 'DELT.x') && tracked.markers.rms < 1e-3, 'tracked markers');
    holds(all(strcmp(tracked.emg.why, 'used')) && numel(tracked.emg.target) == 19, 'tracked EMG');
    holds(strcmp(now.channels.emg.units{1}, '1') && abs(now.interval - 0.03) < 1e-9 && now.window == 7, 'info');
    e.close();

    % EMG on its own, after its frame; the first state; another node.
    e = myohorizon.Estimator(demo, rti{1:2});
    e.set_start([-0.1 -0.3 -0.1 0.1]);
    e.set_node(e.info().window);
    e.set_deadline(0);
    last = [];
    for k = 1:60
        estimate = e.push(t(k), markers(:, :, k));
        e.measure('emg', t(k), emg(:, k));
        if ~isempty(estimate), last = estimate; end
    end
    holds(last.emg_rms < 0.1 && abs(last.time - t(58)) < 1e-9, 'measured alone: %g, %g s', last.emg_rms, last.time);
    e.close();
end

% What is wrong with a frame is refused, and leaves the estimator as it was.
function of_wrong_frames(demo)
    e = myohorizon.Estimator(demo, 'solver.plugin', 'mhe.solver.rti');
    e.push(1, nan(8, 3), nan(19, 1));
    refused('argument', 'markers: the size is 3 x 8; this model takes 8 x 3', @() e.push(10, zeros(3, 8)));
    refused('argument', 'emg: the size is 18 x 1', @() e.push(10, [], zeros(18, 1)));
    refused('argument', 'angles: the size is 5 x 1', @() e.push(10, [], [], zeros(5, 1)));
    refused('argument', 'real doubles', @() e.push(10, single(zeros(8, 3))));
    refused('argument', 'real doubles', @() e.push(10, int32(zeros(8, 3))));
    refused('argument', 'real doubles', @() e.push(10, true(8, 3)));
    refused('argument', 'real doubles', @() e.push(10, sparse(8, 3)));
    refused('argument', 'real doubles', @() e.push(10, complex(zeros(8, 3), 1)));
    refused('argument', 'real doubles', @() e.push(10, {1}));
    refused('argument', 'real doubles', @() e.push(10, 'markers'));
    refused('argument', 'markers: the size', @() e.push(10, zeros(8, 3, 2)));
    refused('argument', 't: a number is needed', @() e.push('now'));
    refused('argument', 't: a number is needed', @() e.push([1 2]));
    refused('argument', 'does not follow', @() e.push(1));
    refused('argument', 'does not follow', @() e.push(NaN));
    refused('argument', 'there is no channel ''forces''', @() e.measure('forces', 1, 0));
    refused('argument', 'emg: the size is 3 x 1', @() e.measure('emg', 1, zeros(3, 1)));
    refused('argument', 'open_emg(columns, rate) comes first', @() e.push_emg(1, 1));
    refused('argument', 'columns: a cell array', @() e.open_emg('Biceps', 2000));
    refused('argument', 'node', @() e.set_node(99));
    refused('argument', 'node: a whole number', @() e.set_node(2 ^ 40));
    refused('argument', 'node: a whole number', @() e.set_node(1.5));
    refused('argument', 'q: the size is 3 x 1', @() e.set_start(zeros(3, 1)));
    refused('argument', '', @() e.set_deadline(-1));
    e.push(10, nan(8, 3), nan(19, 1));
    e.close();
    e.close();
    holds(e.closed(), 'closed');
    for use = {@() e.push(11), @() e.prepare(), @() e.info(), @() e.tracked(), @() e.measure('emg', 1, 1), ...
               @() e.open_emg({'a'}, 1), @() e.push_emg(1, 1), @() e.set_node(0), @() e.set_start([]), @() e.set_deadline(1)}
        refused('closed', 'the estimator is closed', use{1});
    end
end

function of_wrong_calls(demo)
    refused('closed', 'the estimator is closed', @() mhe_gateway('push', uint64(12345), 0));
    refused('closed', 'the estimator is closed', @() mhe_gateway('close', 3));
    refused('closed', 'it is closed', @() mhe_gateway('live_run', uint64(1), 0));
    refused('input', 'none.yaml', @() myohorizon.Estimator('none.yaml'));
    refused('config', 'did you mean ''window''', @() myohorizon.Estimator(demo, 'horizon.windw', 3));
    refused('plugin', 'mhe.cost.none', @() myohorizon.run(demo, 'costs', {'mhe.cost.none'}));
    refused('argument', 'come in pairs', @() myohorizon.run(demo, 'horizon.window'));
    refused('argument', 'a key is a text', @() myohorizon.run(demo, 3, 4));
    refused('argument', 'config: a text is needed', @() myohorizon.run(3));
    refused('argument', 'a file has its own', @() myohorizon.run(demo, 'folder', '.'));
    refused('argument', 'a text is needed', @() mhe_gateway());
    refused('argument', 'knows no ''dance''', @() mhe_gateway('dance'));
    refused('input', 'none.trc', @() myohorizon.read_trc('none.trc'));
    refused('input', 'none.c3d', @() myohorizon.read_c3d('none.c3d'));
    refused('input', 'none.osim', @() myohorizon.Model('none.osim'));
    refused('plugin', 'mhe.solver.rti', @() myohorizon.describe('mhe.solver.rtj'));
    refused('config', 'sources', @() myohorizon.Live(demo));
    refused('input', 'windw', @() myohorizon.batch(demo, struct('a', struct('horizon', struct('windw', 3))), tempname()));
    refused('input', 'none.yaml', @() myohorizon.calibrate('none.yaml', tempname()));
end

% A struct or a text instead of a file; a plugin_path that is not trusted.
function of_configs(source, demo, work)
    folder = fileparts(demo);
    content = struct('model', struct('file', 'arm19.osim'), 'costs', {{'mhe.cost.min-excitation'}});
    e = myohorizon.Estimator(content, 'folder', folder, 'horizon.window', 6);
    holds(e.info().window == 6 && numel(e.muscle_names) == 19, 'of a struct');
    e.close();
    e = myohorizon.Estimator(sprintf('model: {file: arm19.osim}\ncosts: [mhe.cost.min-excitation]\n'), 'folder', folder);
    holds(numel(e.muscle_names) == 19, 'of a text');
    e.close();
    path = fullfile(work, 'plugins.yaml');
    file = fopen(path, 'w');
    fprintf(file, 'plugin_path: [%s]\nmodel: {file: %s/arm19.osim}\ncosts: [mhe.cost.min-excitation]\n', work, folder);
    fclose(file);
    refused('config', 'plugin_path', @() myohorizon.Estimator(path));
    e = myohorizon.Estimator(path, 'trust', true);
    e.close();
end

function of_raw_emg(source)
    folder = fullfile(source, 'models', 'arm19');
    [markers, signals] = myohorizon.read_c3d(fullfile(folder, 'demo_recording.c3d'));
    e = myohorizon.Estimator(fullfile(folder, 'demo_raw.yaml'), 'solver.plugin', 'mhe.solver.rti');
    e.open_emg(signals.labels, signals.rate);
    [~, order] = ismember(e.marker_names, markers.labels);
    last = [];
    next = 1;
    for k = 1:80
        ready = next:find(signals.time <= markers.time(k), 1, 'last');
        e.push_emg(signals.time(ready), signals.values(ready, :));
        next = ready(end) + 1;
        estimate = e.push(markers.time(k), reshape(markers.values(k, :), 3, [])'(order, :));
        if ~isempty(estimate), last = estimate; end
    end
    holds(~isempty(last) && ~isnan(last.emg_rms) && e.info().emg_lag > 0 && e.info().emg_lag < 0.1, 'raw EMG');
    refused('argument', 'raw: the size', @() e.push_emg(10, [1 2]));
    e.close();
end

function of_files(source)
    table = myohorizon.read_trc(fullfile(source, 'models', 'arm19', 'demo_markers.trc'));
    holds(isequal(size(table.values), [301 24]) && max(abs(table.values(:))) < 2 && strcmp(table.unit, 'm'), 'markers');
    table = myohorizon.read_sto(fullfile(source, 'models', 'arm19', 'demo_emg.sto'));
    holds(isequal(size(table.values), [301 19]) && ~table.in_degrees, 'signals');
    [markers, signals] = myohorizon.read_xdf(fullfile(source, 'tests', 'fuzz', 'corpus', 'xdf', 'two_streams.xdf'));
    holds(~isempty(markers) || ~isempty(signals), 'xdf');
end

function of_models(source)
    model = myohorizon.Model(fullfile(source, 'models', 'arm26', 'arm26.osim'));
    holds(isequal(model.coordinate_names(), {'r_shoulder_elev', 'r_elbow_flex'}) && numel(model.marker_names()) == 3, 'names');
    holds(any(strcmp(model.muscle_names(), 'BRA')) && any(strcmp(model.body_names(), 'r_humerus')), 'names');
    holds(abs(model.mass() - 3.398887) < 1e-6, 'mass');
    at = struct('q', struct('r_elbow_flex', 1.2), 'activation', 0.5);
    pose = model.evaluate(at);
    holds(abs(pose.muscles.BRA.tendon_force - 482.5016265169135) < 1e-9, '%.12g', pose.muscles.BRA.tendon_force);
    step = @(h) setfield(at, 'q', struct('r_elbow_flex', 1.2 + h));
    poses = model.evaluate_all({step(-1e-5), at, step(1e-5)});
    arm = (poses{1}.lines.BRA.length - poses{3}.lines.BRA.length) / 2e-5;
    holds(abs(arm - pose.lines.BRA.moment_arm.r_elbow_flex) < 1e-7, 'a moment arm is a derivative');
    holds(model.evaluate(at, 'fitted').muscles.BRA.tendon_force > 400, 'fitted');
    refused('argument', '''exact'' or ''fitted''', @() model.evaluate(at, 'straight'));
    refused('input', 'elbow', @() model.evaluate(struct('q', struct('elbow', 1))));
    holds(any(strcmp(myohorizon.version(), regexp(myohorizon.version(), '\d+\.\d+\.\d+', 'match'))), 'version');
    holds(~isempty(strfind(jsonencode(myohorizon.plugins()), 'mhe.cost.callback')), 'plugins');
    holds(~isempty(strfind(jsonencode(myohorizon.describe()), 'horizon')), 'describe');
end

function of_a_session(source, demo, work)
    trials = struct('seven', struct(), 'five', struct('horizon', struct('window', 5)), ...
                    'gone', struct('data', struct('markers', 'none.trc')));
    rows = myohorizon.batch(demo, trials, fullfile(work, 'session'), 'workers', 2, 'solver.plugin', 'mhe.solver.rti', ...
                            'output.picture', false);
    holds(isequal({rows.trial}, {'seven', 'five', 'gone'}), 'trials');
    holds(strcmp(rows(1).usable, 'yes') && rows(1).estimates == 94 && rows(1).rmse_force_n < 5, 'seven');
    holds(rows(2).estimates > 94 && strcmp(rows(3).usable, 'failed') && rows(3).exit_status == 2, 'five, gone');
    holds(~isempty(strfind(rows(3).reason, 'none.trc')) && isnan(rows(3).rmse_force_n), 'gone: %s', rows(3).reason);
end

% The demo with the EMG of one muscle too small by a quarter.
function of_a_person(source, work)
    folder = fullfile(source, 'models', 'arm19');
    emg = myohorizon.read_sto(fullfile(folder, 'demo_emg.sto'));
    emg.values(:, strcmp(emg.labels, 'BRA')) *= 0.75;
    file = fopen(fullfile(work, 'weak.sto'), 'w');
    fprintf(file, 'weak\nversion=1\nnRows=%d\nnColumns=%d\ninDegrees=no\nendheader\n', numel(emg.time), 1 + numel(emg.labels));
    fprintf(file, '%s\n', strjoin([{'time'}, emg.labels], "\t"));
    fprintf(file, [repmat('%.17g\t', 1, numel(emg.labels)) '%.17g\n'], [emg.time, emg.values]');
    fclose(file);
    file = fopen(fullfile(work, 'person.yaml'), 'w');
    fprintf(file, ['model: {file: %s/arm19.osim}\nmuscle: {curves: degroote2016}\nhorizon: {window: 7, ratio: 3}\n' ...
                   'bounds: {residual_torques: true}\n' ...
                   'costs: [{plugin: mhe.cost.emg-markers, markers: 0.001, emg_spread: 0.1, residual_torque: 0.1}]\n' ...
                   'calibrate:\n  recordings: [{markers: %s/demo_markers.trc, emg: weak.sto}]\n' ...
                   '  parameters: [{name: emg_gain, muscles: [BRA]}]\n'], folder, folder);
    fclose(file);
    found = myohorizon.calibrate(fullfile(work, 'person.yaml'), fullfile(work, 'person'));
    row = found.parameters;
    holds(strcmp(found.outcome, 'converged') && strcmp(row.parameter, 'emg_gain of BRA') && row.before == 1, 'a person');
    holds(row.after ~= 1 && row.after >= row.lower && row.after <= row.upper, 'gain %g', row.after);
    holds(numel(myohorizon.Model(found.model).muscle_names()) == 19, 'model');
end

% The demo as a stream, as fast as it comes; then recorded.
function of_streams(source, work)
    demo = fullfile(source, 'models', 'arm19', 'live.yaml');
    live = myohorizon.Live(demo, 'sinks', {}, 'sources.0.speed', 0, 'realtime.deadline_ms', 0, ...
                           'out', work, 'record', fullfile(work, 'live.xdf'));
    live.run(1);
    told = live.summary();
    holds(isstruct(told) && told.estimates > 50, '%s', jsonencode(told));
    holds(isstruct(live.state()), 'state');
    refused('argument', '', @() live.command('dance'));
    live.close();
    live.close();
    refused('closed', 'it is closed', @() live.run(1));
    holds(exist(fullfile(work, 'live.xdf'), 'file') == 2, 'no recording');
end

% Many, opened and closed; some left open at the end.
function many(demo)
    for k = 1:100
        one = myohorizon.Estimator(demo, 'solver.plugin', 'mhe.solver.rti');
        one.close();
    end
    left = myohorizon.Estimator(demo, 'solver.plugin', 'mhe.solver.rti'); %#ok<NASGU>
end
