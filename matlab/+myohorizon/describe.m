% SPDX-License-Identifier: Apache-2.0
function told = describe(id)
    % A plugin with its options as a struct; 'config', the default: the keys of a configuration.
    if nargin < 1, id = 'config'; end
    told = jsondecode(mhe_gateway('describe', id));
end
