% SPDX-License-Identifier: Apache-2.0
function [markers, signals] = read_both(file)
    [markers, why] = tried('markers', file);
    [signals, too] = tried('signals', file);
    if ~isempty(why) && ~isempty(too)
        rethrow(why);
    end
end

function [table, why] = tried(kind, file)
    table = [];
    why = [];
    try
        table = mhe_gateway('read', kind, file);
    catch caught
        if ~strcmp(caught.identifier, 'myohorizon:input')
            rethrow(caught);
        end
        why = caught;
    end
end
