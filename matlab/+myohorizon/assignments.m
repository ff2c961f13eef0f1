% SPDX-License-Identifier: Apache-2.0
function texts = assignments(pairs)
    % {'horizon.window', 5} as {'horizon.window=5'}; values are texts (YAML), numbers, logicals, structs, cells.
    if mod(numel(pairs), 2) ~= 0
        error('myohorizon:argument', 'keys and values come in pairs');
    end
    texts = cell(1, numel(pairs) / 2);
    for i = 1:numel(texts)
        key = pairs{2 * i - 1};
        value = pairs{2 * i};
        if ~ischar(key)
            error('myohorizon:argument', 'a key is a text, such as ''horizon.window''');
        end
        if ~ischar(value)
            value = jsonencode(value);
        end
        texts{i} = [key '=' value];
    end
end
