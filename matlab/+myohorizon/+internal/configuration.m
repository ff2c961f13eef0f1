% SPDX-License-Identifier: Apache-2.0
function given = configuration(config, pairs)
    % What the gateway takes for a config: {config, assignments, folder, trust}.
    %
    % config: path of a YAML file; a struct; or the YAML itself, a text of several lines. pairs: {'horizon.window', 5, ...},
    % and among them 'folder' (where relative paths of a struct or text start) and 'trust' (follow a plugin_path in the file).
    if isstruct(config)
        config = [jsonencode(config) sprintf('\n')];
    end
    [texts, rest] = myohorizon.internal.assignments(pairs, {'folder', 'trust'});
    if ~isfield(rest, 'folder'), rest.folder = ''; end
    if ~isfield(rest, 'trust'), rest.trust = false; end
    given = {config, texts, rest.folder, logical(rest.trust)};
end
