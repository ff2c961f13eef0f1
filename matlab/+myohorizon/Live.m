% SPDX-License-Identifier: Apache-2.0
classdef Live < handle
    % A config with the sections sources and sinks, run as mhe-live does.
    %
    %   live = myohorizon.Live('live.yaml', 'record', 'session.xdf');
    %   live.run(60);                        % s of estimates; 0: until the sources end
    %   summary = live.summary();
    %   live.close();
    %
    % Behind the config keys and values as with --set, and: 'out', folder of recordings and MVC files; 'record', an .xdf to
    % record, which must not exist; 'wait', s to wait for all streams, 0: for ever; 'folder', 'trust' as of Estimator.
    properties (Access = private)
        handle_ = uint64(0);
    end
    methods
        function self = Live(config, varargin)
            [pairs, own] = myohorizon.internal.take(varargin, {'out', 'record', 'wait'}, {'', '', 0});
            given = myohorizon.internal.configuration(config, pairs);
            self.handle_ = mhe_gateway('live_open', given{:}, own{:});
        end

        function run(self, seconds)
            % Waits for the streams and estimates until the end of all sources, a sink's "stop", or `seconds` of estimates.
            if nargin < 2, seconds = 0; end
            mhe_gateway('live_run', self.handle_, seconds);
        end

        function command(self, line)
            % 'record-start', 'record-stop', 'mvc-start ELECTRODE', 'mvc-stop', 'label CAME=MODEL', 'stop'.
            mhe_gateway('live_command', self.handle_, line);
        end

        function now = state(self)
            % What the run is at, as its sinks have it.
            now = jsondecode(mhe_gateway('live_state', self.handle_));
        end

        function told = summary(self)
            % Streams, frames, latencies, sinks.
            told = jsondecode(mhe_gateway('live_summary', self.handle_));
        end

        function close(self)
            % Ends it; twice is fine.
            if self.handle_ ~= uint64(0)
                old = self.handle_;
                self.handle_ = uint64(0);
                mhe_gateway('live_close', old);
            end
        end

        function delete(self)
            self.close();
        end
    end
end
