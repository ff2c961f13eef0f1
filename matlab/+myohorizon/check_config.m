% SPDX-License-Identifier: Apache-2.0
function [verdict, findings] = check_config(config, varargin)
    % What mhe-run --check finds without estimating: 'yes', 'doubtful' or 'no', and a struct array of weight, text, remedy.
    given = myohorizon.internal.configuration(config, varargin);
    told = mhe_gateway('check', given{:});
    verdict = told.verdict;
    findings = told.findings;
end
