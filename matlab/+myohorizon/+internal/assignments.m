% SPDX-License-Identifier: Apache-2.0
function [texts, rest] = assignments(pairs, own)
    % {'horizon.window', 5} as {'horizon.window=5'}; values are texts (YAML), numbers, logicals, structs, cells.
    %
    % own: names that are no keys of a config; their values are handed back as fields of rest.
    if nargin < 2, own = {}; end
    if mod(numel(pairs), 2) ~= 0
        error('myohorizon:argument', 'keys and values come in pairs');
    end
    texts = cell(1, 0);
    rest = struct();
    for i = 1:2:numel(pairs)
        key = pairs{i};
        value = pairs{i + 1};
        if ~ischar(key)
            error('myohorizon:argument', 'a key is a text, such as ''horizon.window''');
        end
        if any(strcmp(key, own))
            rest.(key) = value;
            continue
        end
        if ~ischar(value)
            value = jsonencode(value);
        end
        texts{end + 1} = [key '=' value]; %#ok<AGROW>
    end
end
