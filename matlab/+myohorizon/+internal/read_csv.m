% SPDX-License-Identifier: Apache-2.0
function rows = read_csv(path, texts)
    % A struct array, a row of the table each; columns but `texts` are numbers, NaN where the cell is empty.
    lines = strsplit(strtrim(fileread(path)), sprintf('\n'));
    header = cells_of(lines{1});
    columns = cell(numel(lines) - 1, numel(header));
    for i = 2:numel(lines)
        columns(i - 1, :) = cells_of(lines{i});
    end
    is_number = ~ismember(header, texts);
    columns(:, is_number) = num2cell(cellfun(@number_of, columns(:, is_number)));
    rows = cell2struct(columns, header, 2);
end

function cells = cells_of(line)
    % Cells may be quoted, with "" for a quote; a cell has no line break.
    found = regexp([',' strtrim(line)], ',(?:"((?:[^"]|"")*)"|([^",]*))', 'tokens');
    cells = cellfun(@(token) strrep([token{:}], '""', '"'), found, 'UniformOutput', false);
end

function number = number_of(text)
    number = str2double(text);
end
