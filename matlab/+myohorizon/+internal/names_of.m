% SPDX-License-Identifier: Apache-2.0
function names = names_of(entries)
    % Names of what jsondecode makes of a list: texts, or structs with a name; of the same fields each, or not.
    if isempty(entries)
        names = cell(1, 0);
    elseif iscellstr(entries)
        names = entries(:)';
    elseif iscell(entries)
        names = cellfun(@(entry) entry.name, entries(:)', 'UniformOutput', false);
    else
        names = {entries.name};
    end
end
