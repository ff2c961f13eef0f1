% SPDX-License-Identifier: Apache-2.0
classdef Model
    % A model file, .osim or .bioMod: what mhe-model tells.
    %
    %   m = myohorizon.Model('arm26.osim');
    %   pose = m.evaluate(struct('q', struct('r_elbow_flex', 1.2), 'activation', 0.5));
    %   pose.muscles.BRA.tendon_force        % N
    properties (SetAccess = private)
        path
        info % struct: coordinates, bodies (kg), muscles (N, m, rad), obstacles, markers, unsupported, ...
    end
    methods
        function self = Model(path)
            self.path = path;
            self.info = jsondecode(mhe_gateway('model_info', path));
        end

        function found = coordinate_names(self)
            found = myohorizon.internal.names_of(self.info.coordinates);
        end

        function found = muscle_names(self)
            found = myohorizon.internal.names_of(self.info.muscles);
        end

        function found = marker_names(self)
            found = myohorizon.internal.names_of(self.info.markers);
        end

        function found = body_names(self)
            found = myohorizon.internal.names_of(self.info.bodies);
        end

        function kg = mass(self)
            % Of all bodies.
            kg = self.info.mass;
        end

        function pose = evaluate(self, at, paths)
            % The model at a posture: a struct with fields q, u, udot (rad, m and per s), activation, forces (N), external;
            % what is left out has its default. paths: 'exact', or 'fitted'. Fields of the answer: mhe/inspect.h.
            if nargin < 3, paths = 'exact'; end
            poses = self.evaluate_all({at}, paths);
            pose = poses{1};
        end

        function poses = evaluate_all(self, ats, paths)
            % The same of many postures, a cell of structs: a cell of structs.
            if nargin < 3, paths = 'exact'; end
            texts = cellfun(@jsonencode, ats(:)', 'UniformOutput', false);
            question = ['{"poses": [' strjoin(texts, ', ') ']}'];
            answer = jsondecode(mhe_gateway('model_evaluate', self.path, question, paths));
            if iscell(answer.poses)
                poses = answer.poses;
            else
                poses = num2cell(answer.poses);
            end
        end
    end
end
