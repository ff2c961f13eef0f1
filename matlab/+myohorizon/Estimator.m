% SPDX-License-Identifier: Apache-2.0
classdef Estimator < handle
    % Moving horizon estimator: frames in, estimates out.
    %
    %   e = myohorizon.Estimator('arm.yaml', 'horizon.window', 7);
    %   estimate = e.push(t, markers, emg);   % [] until there is one
    %   e.prepare();                          % what can be done before the next frame
    %   e.close();
    %
    % config: path of a YAML file; or a struct; or the YAML itself, a text of several lines. Keys and values behind it are as
    % with --set of mhe-run; 'folder', where relative paths of a struct or text start; 'trust', true: follow a plugin_path.
    properties (SetAccess = private)
        coordinate_names % cell of texts, the order of q, qdot, moment
        muscle_names     % of activation, excitation, force
        marker_names     % rows of markers
    end
    properties (Access = private)
        handle_ = uint64(0);
    end
    methods
        function self = Estimator(config, varargin)
            given = myohorizon.internal.configuration(config, varargin);
            self.handle_ = mhe_gateway('open', given{:});
            names = mhe_gateway('info', self.handle_);
            self.coordinate_names = names.coordinate_names;
            self.muscle_names = names.muscle_names;
            self.marker_names = names.marker_names;
        end

        function estimate = push(self, t, markers, emg, angles)
            % The next frame at t (s, increasing): markers [n_markers x 3] m, ground frame; emg [n_muscles x 1],
            % normalised 0..1; angles [n_coordinates x 1] rad (m). NaN is missing, [] is all missing.
            % A struct: time (s), status ('ok', 'iteration_limit', 'deadline', 'predicted', 'restarted'), phase, q, qdot
            % (rad, rad/s; m, m/s), activation, excitation (1), force (N), moment, residual (N m), markers [n_markers x 3]
            % (m), marker_rms (m), emg_rms (1), solve_time, latency (s), iterations, kkt_residual; with output.uncertainty
            % q_sd, activation_sd, force_sd, moment_sd; with output.reactions reactions [n_joints x 6] (N, N m); or [].
            if nargin < 3, markers = []; end
            if nargin < 4, emg = []; end
            if nargin < 5, angles = []; end
            estimate = mhe_gateway('push', self.handle_, t, markers, emg, angles);
        end

        function prepare(self)
            % Does what can be done before the next frame is there; results are the same with and without it.
            mhe_gateway('prepare', self.handle_);
        end

        function measure(self, channel, t, values)
            % A measurement of one channel ('markers', 'emg', 'angles', or another of info().channels) at a time of its
            % own, s, earlier or later than the newest frame. Sizes are those of push.
            mhe_gateway('measure', self.handle_, channel, t, values);
        end

        function open_emg(self, columns, rate)
            % From now on raw EMG of electrodes comes by push_emg. columns: cell of the names of a sample's numbers, among
            % them the config's channels; rate in Hz. Before the first push.
            mhe_gateway('open_emg', self.handle_, columns, rate);
        end

        function push_emg(self, t, raw)
            % Raw EMG: samples raw [n x n_columns] at times t [n x 1], s; NaN where missing.
            mhe_gateway('push_emg', self.handle_, t, raw);
        end

        function found = tracked(self)
            % What the last estimate tracked: a struct, a field a channel, of structs with measured, target, weight,
            % estimated [n x 1], why ('used', 'missing', 'far', 'saturated', 'unread'), columns, n_measured, n_left_out,
            % rms. No fields where the last push gave no estimate.
            found = mhe_gateway('tracked', self.handle_);
        end

        function set_start(self, q, qdot)
            % The first state where the config leaves it open: q, qdot [n_coordinates x 1]; NaN or []: not known.
            if nargin < 3, qdot = []; end
            mhe_gateway('set_start', self.handle_, q, qdot);
        end

        function set_node(self, node)
            % Whose estimates are given: 0, the window's oldest frame, to info().window, the newest.
            mhe_gateway('set_node', self.handle_, node);
        end

        function set_deadline(self, seconds)
            % Time from a frame to its estimate after which a solve ends with what it has, s; 0: no limit.
            mhe_gateway('set_deadline', self.handle_, seconds);
        end

        function now = info(self)
            % window, ratio, interval (s), node, delay (s), phase ('empty' .. 'running'), emg_lag (s), names, channels (a
            % field each: columns, units, signal, delay, gap), dropped, config (YAML with every default).
            now = mhe_gateway('info', self.handle_);
        end

        function yes = closed(self)
            yes = self.handle_ == uint64(0);
        end

        function close(self)
            % Gives back its memory; twice is fine.
            if ~self.closed()
                old = self.handle_;
                self.handle_ = uint64(0);
                mhe_gateway('close', old);
            end
        end

        function delete(self)
            self.close();
        end
    end
end
