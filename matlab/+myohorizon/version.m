% SPDX-License-Identifier: Apache-2.0
function text = version()
    % Version of libmhe.so.
    text = mhe_gateway('version');
end
