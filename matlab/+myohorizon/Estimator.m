% SPDX-License-Identifier: Apache-2.0
classdef Estimator < handle
    % Moving horizon estimator: frames in, estimates out.
    %
    %   e = myohorizon.Estimator('arm.yaml', 'horizon.window', 7);
    %   estimate = e.push(t, markers, emg);   % [] until there is one
    %   e.prepare();                          % what can be done before the next frame
    %   e.close();
    %
    % Keys and values behind the config are as with --set of mhe-run. One estimator per thread.
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
            self.handle_ = mhe_gateway('open', config, myohorizon.assignments(varargin));
            names = mhe_gateway('info', self.handle_);
            self.coordinate_names = names.coordinate_names;
            self.muscle_names = names.muscle_names;
            self.marker_names = names.marker_names;
        end

        function estimate = push(self, t, markers, emg, angles)
            % The next frame at t (s, increasing): markers [n_markers x 3] m, ground frame; emg [n_muscles x 1],
            % normalised 0..1; angles [n_coordinates x 1] rad (m). NaN is missing, [] is all missing.
            % A struct: time (s), status (0 ok, 1 iteration limit, 2 deadline, 3 predicted, 4 restarted), q, qdot
            % (rad, rad/s; m, m/s), activation, excitation (1), force (N), moment, residual (N m), markers (m),
            % marker_rms (m), emg_rms (1), solve_time, latency (s), iterations; or [].
            if nargin < 3, markers = []; end
            if nargin < 4, emg = []; end
            if nargin < 5, angles = []; end
            estimate = mhe_gateway('push', self.handle_, t, markers, emg, angles);
        end

        function prepare(self)
            % Does what can be done before the next frame is there.
            mhe_gateway('prepare', self.handle_);
        end

        function now = info(self)
            % window, ratio, interval (s), node, delay (s), phase (0 empty .. 4 running), names.
            now = mhe_gateway('info', self.handle_);
        end

        function close(self)
            % Gives back its memory; twice is fine.
            if self.handle_ ~= uint64(0)
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
