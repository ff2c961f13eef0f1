% SPDX-License-Identifier: Apache-2.0
classdef Model
    % A model file, .osim or .bioMod: what mhe-model tells.
    %
    %   m = myohorizon.Model('arm26.osim');
    %   pose = m.evaluate(struct('q', struct('r_elbow_flex', 1.2), 'activation', 0.5));
    %   pose.muscles.BRA.tendon_force        % N
    properties (SetAccess = private)
        file
        info % struct: coordinates, bodies (kg), muscles (N, m, rad), obstacles, markers, unsupported, ...
    end
    methods
        function self = Model(file)
            self.file = file;
            self.info = jsondecode(mhe_gateway('model_info', file));
        end

        function pose = evaluate(self, at)
            % The model at a posture: a struct with fields q, u, udot (rad, m and per s), activation, forces (N);
            % what is left out has its default. Fields of the answer: mhe/inspect.h.
            answer = jsondecode(mhe_gateway('model_evaluate', self.file, ['{"poses": [' jsonencode(at) ']}']));
            pose = answer.poses(1);
        end
    end
end
