% SPDX-License-Identifier: Apache-2.0
function [pairs, values] = take(pairs, names, values)
    % Takes the pairs of these names out of {key, value, ...}; what is not given keeps its value.
    for i = 1:numel(names)
        at = find(cellfun(@(key) ischar(key) && strcmp(key, names{i}), pairs(1:2:end)), 1);
        if ~isempty(at) && 2 * at <= numel(pairs)
            values{i} = pairs{2 * at};
            pairs(2 * at - 1:2 * at) = [];
        end
    end
end
