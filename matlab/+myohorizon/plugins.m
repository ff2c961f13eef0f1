% SPDX-License-Identifier: Apache-2.0
function found = plugins()
    % All plugins that are found, and the files that were refused, as mhe-run --list-plugins --json tells.
    found = jsondecode(mhe_gateway('plugins'));
end
