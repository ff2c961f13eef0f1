/* SPDX-License-Identifier: Apache-2.0 */
/* settings.c: options of this plugin -> options of Ipopt. */
#include "ipopt_solver.h"

#include <errno.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>

static int32_t is_int(const char *text, int *value) {
    char *end;
    errno = 0;
    long number = strtol(text, &end, 10);
    *value = (int)number;
    return errno == 0 && end != text && *end == '\0' && number > INT_MIN && number < INT_MAX;
}

static int32_t is_real(const char *text, double *value) {
    char *end;
    *value = strtod(text, &end);
    return end != text && *end == '\0';
}

/* Ipopt types its options, text does not: the first type that Ipopt takes is the right one. The C
 * interface takes char * but writes to neither. */
static int32_t set(IpoptProblem ipopt, const char *name, const char *value) {
    int whole;
    double real;
    return (is_int(value, &whole) && AddIpoptIntOption(ipopt, (char *)name, whole)) ||
           (is_real(value, &real) && AddIpoptNumOption(ipopt, (char *)name, real)) ||
           AddIpoptStrOption(ipopt, (char *)name, (char *)value);
}

/* Name and value of what differs from Ipopt's own defaults whatever the configuration. */
static const char *const presets[][2] = {
    {"nlp_scaling_method", "user-scaling"},
    /* An estimate must not leave its bounds, even by 1e-8. */
    {"bound_relax_factor", "0"},
    /* A shifted solution stays where it is, on its bounds too. */
    {"warm_start_bound_push", "1e-9"},
    {"warm_start_bound_frac", "1e-9"},
    {"warm_start_slack_bound_push", "1e-9"},
    {"warm_start_slack_bound_frac", "1e-9"},
    {"warm_start_mult_bound_push", "1e-9"},
    /* The limits on the violations that count are set below, with the objective's scale. */
    {"acceptable_compl_inf_tol", "1e20"},
};

/* MUMPS without the permutation to a zero-free diagonal and with row scaling alone: the same
 * iterates in three quarters of the time on banded problems of this size. */
static const char *const mumps_presets[][2] = {
    {"mumps_permuting_scaling", "0"},
    {"mumps_scaling", "8"},
};

/* Ipopt reports a refused option on its console, which is silent only once an initialisation has
 * read print_level; a solve without a starting point is an initialisation alone. */
static void silence(IpoptProblem ipopt) {
    set(ipopt, "print_level", "0");
    set(ipopt, "sb", "yes");
    set(ipopt, "option_file_name", ""); /* never read ipopt.opt of the working directory */
    (void)IpoptSolve(ipopt, NULL, NULL, NULL, NULL, NULL, NULL, NULL);
}

static mhe_status refused(const char *name, const char *value, mhe_error *err) {
    return mhe_fail(err, MHE_E_CONFIG, "Ipopt %s takes no option '%s: %s'", IPOPT_VERSION, name,
                    value);
}

mhe_status ipopt_configure(IpoptProblem ipopt, const struct ipopt_config *config, double scale,
                           mhe_error *err) {
    silence(ipopt);
    SetIpoptProblemScaling(ipopt, scale, NULL, NULL);
    for (size_t i = 0; i < sizeof presets / sizeof presets[0]; i++) {
        if (!set(ipopt, presets[i][0], presets[i][1])) {
            return refused(presets[i][0], presets[i][1], err);
        }
    }
    for (size_t i = 0; i < sizeof mumps_presets / sizeof mumps_presets[0]; i++) {
        set(ipopt, mumps_presets[i][0], mumps_presets[i][1]); /* an Ipopt may lack MUMPS */
    }
    /* Ipopt's second set of limits holds for the unscaled problem. The complementarity is kept
     * tighter than the rest, since it biases variables away from their bounds. */
    const struct {
        const char *name;
        double value;
    } limits[] = {
        {"tol", config->tolerance},
        {"dual_inf_tol", config->tolerance / scale},
        {"compl_inf_tol", 0.1 * config->tolerance / scale},
        {"constr_viol_tol", 0.1 * config->tolerance},
        {"acceptable_tol", config->acceptable_tolerance},
        {"acceptable_dual_inf_tol", config->acceptable_tolerance / scale},
        {"acceptable_constr_viol_tol", config->acceptable_tolerance},
    };
    for (size_t i = 0; i < sizeof limits / sizeof limits[0]; i++) {
        AddIpoptNumOption(ipopt, (char *)limits[i].name, limits[i].value);
    }
    AddIpoptIntOption(ipopt, "max_iter", config->max_iterations);
    AddIpoptIntOption(ipopt, "acceptable_iter", config->acceptable_iterations);
    if (!set(ipopt, "linear_solver", config->linear_solver)) {
        return refused("linear_solver", config->linear_solver, err);
    }
    for (int32_t i = 0; i < config->options.n; i++) {
        if (!set(ipopt, config->options.keys[i], config->options.values[i])) {
            return refused(config->options.keys[i], config->options.values[i], err);
        }
    }
    if (config->print_level > 0) {
        AddIpoptIntOption(ipopt, "print_level", config->print_level);
    }
    return MHE_OK;
}

mhe_status ipopt_check(const struct ipopt_config *config, mhe_error *err) {
    uint8_t one = 1;
    int32_t of = 0;
    double lower = 0, upper = 1, zero = 0;
    mhe_stage_problem none = {.n_x = 1, .xx_pattern = &one};
    nlp smallest = {.problem = &none, .n = 1, .of = &of, .lower = &lower, .upper = &upper};
    IpoptProblem ipopt = ipopt_problem(&smallest, &lower, &upper, &zero, &zero);
    if (ipopt == NULL) {
        return mhe_fail(err, MHE_E_INTERNAL, "Ipopt %s refuses a problem of one variable",
                        IPOPT_VERSION);
    }
    mhe_status status = ipopt_configure(ipopt, config, 1, err);
    FreeIpoptProblem(ipopt);
    return status;
}

/* The value that the map gives to an option of Ipopt; else `otherwise`. */
static const char *chosen(const struct ipopt_config *config, const char *name,
                          const char *otherwise) {
    for (int32_t i = 0; i < config->options.n; i++) {
        if (strcmp(config->options.keys[i], name) == 0) {
            return config->options.values[i];
        }
    }
    return otherwise;
}

void ipopt_warm_start(IpoptProblem ipopt, const struct ipopt_config *config, int32_t warm) {
    /* A barrier parameter that stays where the last solve left it needs the fewest iterations, but
     * only near a solution. */
    int32_t adaptive = config->mu_strategy == 1 || (config->mu_strategy == 0 && !warm);
    char mu[32];
    (void)snprintf(mu, sizeof mu, "%.17g", warm ? config->mu_init_warm : 0.1);
    const char *const options[][2] = {{"warm_start_init_point", warm ? "yes" : "no"},
                                      {"mu_strategy", adaptive ? "adaptive" : "monotone"},
                                      {"mu_init", mu}};
    for (size_t i = 0; i < sizeof options / sizeof options[0]; i++) {
        set(ipopt, options[i][0], chosen(config, options[i][0], options[i][1]));
    }
}
