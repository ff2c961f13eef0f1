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
        holds(~isempty(strfind(caught.message, text)), '%s', caught.message);
        return
    end
    error('FAILED: nothing was refused: %s', text);
end

function test_myohorizon(source, work)
    demo = fullfile(source, 'models', 'arm19', 'demo.yaml');
    arm = fullfile(source, 'models', 'arm26', 'arm26.osim');

    % A whole recording: the bits that mhe-run has written.
    results = myohorizon.run(demo);
    holds(strcmp(results.verdict, 'yes') && results.rmse.force < 5, 'verdict %s', results.verdict);
    written = load(fullfile(work, 'demo', 'results.mat'));
    holds(isequal(written.forces.labels(:), results.muscle_names(:)), 'labels');
    holds(isequal(written.forces.time(:), results.time(:)) && numel(results.time) > 80, 'times');
    holds(isequal(written.forces.data, results.force), 'forces');
    holds(isequal(written.estimates.data, [results.q, results.qdot, results.activation, results.excitation]), 'states');

    % Frame by frame: the same bits.
    rti = {'solver.plugin', 'mhe.solver.rti'};
    results = myohorizon.run(demo, rti{:});
    markers = myohorizon.read_markers(fullfile(source, 'models', 'arm19', 'demo_markers.trc'));
    emg = myohorizon.read_signals(fullfile(source, 'models', 'arm19', 'demo_emg.sto'));
    e = myohorizon.Estimator(demo, rti{:});
    [~, of_marker] = ismember(e.marker_names, markers.labels);
    [~, of_muscle] = ismember(e.muscle_names, emg.labels);
    n = 0;
    for k = 1:numel(markers.time)
        points = reshape(markers.values(k, :), 3, [])'(of_marker, :);
        estimate = e.push(markers.time(k), points, emg.values(k, of_muscle)');
        e.prepare();
        if ~isempty(estimate)
            n = n + 1;
            holds(isequal(estimate.force', results.force(n, :)), 'forces of estimate %d', n);
            holds(isequal(reshape(estimate.markers', 1, []), results.markers(n, :)), 'markers of estimate %d', n);
        end
    end
    holds(n == numel(results.time) && e.info().phase == 4, '%d estimates', n);

    % What is wrong.
    refused('argument', 'markers: the size is 3 x 8; this model takes 8 x 3', @() e.push(10, zeros(3, 8)));
    refused('argument', 'emg: the size is 18 x 1', @() e.push(10, [], zeros(18, 1)));
    refused('argument', 'real doubles', @() e.push(10, single(zeros(8, 3))));
    refused('argument', 'real doubles', @() e.push(10, complex(zeros(8, 3), 1)));
    refused('argument', 'real doubles', @() e.push(10, {1}));
    refused('argument', 't: a number is needed', @() e.push('now'));
    refused('argument', 'does not follow', @() e.push(markers.time(end)));
    refused('argument', 'does not follow', @() e.push(NaN));
    e.push(10, nan(8, 3), nan(19, 1));
    e.close();
    e.close();
    refused('closed', 'the estimator is closed', @() e.push(11));
    refused('closed', 'the estimator is closed', @() mhe_gateway('push', uint64(12345), 0));
    refused('closed', 'the estimator is closed', @() mhe_gateway('close', 3));
    refused('input', 'none.yaml', @() myohorizon.Estimator('none.yaml'));
    refused('config', 'did you mean ''window''', @() myohorizon.Estimator(demo, 'horizon.windw', 3));
    refused('plugin', 'mhe.cost.none', @() myohorizon.run(demo, 'costs', {'mhe.cost.none'}));
    refused('argument', 'come in pairs', @() myohorizon.run(demo, 'horizon.window'));
    refused('argument', 'config: a text is needed', @() myohorizon.run(3));
    refused('argument', 'a text is needed', @() mhe_gateway());
    refused('argument', 'knows no ''dance''', @() mhe_gateway('dance'));
    refused('input', 'none.trc', @() myohorizon.read_markers('none.trc'));
    refused('input', 'none.osim', @() myohorizon.Model('none.osim'));

    % Models.
    model = myohorizon.Model(arm);
    holds(strcmp(model.info.muscles(end).name, 'BRA'), 'muscles');
    pose = model.evaluate(struct('q', struct('r_elbow_flex', 1.2), 'activation', 0.5));
    holds(abs(pose.muscles.BRA.tendon_force - 482.5016265169135) < 1e-9, '%.12g', pose.muscles.BRA.tendon_force);

    % Many, opened and closed; some left open at the end.
    for k = 1:300
        one = myohorizon.Estimator(demo, rti{:});
        one.close();
    end
    left = myohorizon.Estimator(demo, rti{:}); %#ok<NASGU>
    disp('all as it should be');
end
