% SPDX-License-Identifier: Apache-2.0
function [status, message] = run_program(name, words, pairs)
    % Runs a program that came with the library; message is the last line that it said. What is wrong with the input is an
    % error.
    folder = mhe_gateway('programs');
    if ~isempty(folder)
        name_of_file = fullfile(folder, name);
    else
        name_of_file = name;
    end
    for set = myohorizon.internal.assignments(pairs)
        words = [words, {'--set', set{1}}]; %#ok<AGROW>
    end
    quoted = cellfun(@(word) ['''' strrep(word, '''', '''\''''') ''''], [{name_of_file}, words], 'UniformOutput', false);
    [status, said] = system([strjoin(quoted, ' ') ' 2>&1 > /dev/null']);
    lines = strsplit(strtrim(said), sprintf('\n'));
    message = lines{end};
    if strncmp(message, [name ': '], numel(name) + 2)
        message = message(numel(name) + 3:end);
    end
    if status == 2
        error('myohorizon:input', '%s', message);
    end
end
