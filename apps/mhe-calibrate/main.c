/* SPDX-License-Identifier: Apache-2.0 */
/* mhe-calibrate: a person's parameters from recordings: a model file, a config that uses it, and
 * what they are worth. */
#include "calibrate/person.h"
#include "console.h"
#include "report.h"
#include "scaled.h"
#include "words.h"

#include <math.h>
#include <mhe/outbox.h>
#include <string.h>

typedef struct arguments {
    const char *config, *out;
    words_list set, others;
    int32_t mode, quiet;
} arguments;

#define AT(field) offsetof(arguments, field)

static const words_command commands[] = {
    {.name = "",
     .operand = "CONFIG.yaml",
     .what = "config file",
     .help = "of mhe-run, with a section calibrate: what is estimated from which recordings",
     .most = 1}};

static const words_option options[] = {
    WORDS_OUT("folder of the results; ./out/<config's name>-calibrated unless given", 0, AT(out)),
    WORDS_SET("config", 0, AT(set)), WORDS_QUIET("progress", AT(quiet))};

static const words_program program = {
    .name = "mhe-calibrate",
    .summary = "Estimates parameters of a person from recordings.",
    .usage = "  mhe-calibrate CONFIG.yaml --out DIR [--set path.to.key=value]... [--quiet]\n"
             "  mhe-calibrate --version | --help\n",
    .notes = "DIR gets calibrated.osim, calibrated.yaml (a config of mhe-run that uses it),\n"
             "parameters.csv, calibration.json and report.html.\n\n"
             "Exit status: 0 done; 2 the command line, the config or a recording is wrong; 1\n"
             "anything else.\n",
    .commands = commands,
    .n_commands = 1,
    .options = options,
    .n_options = sizeof options / sizeof options[0],
    .mode = AT(mode),
    .operand = AT(config),
    .others = AT(others)};

static int32_t show(void *data, int32_t iteration, double objective, double kkt) {
    const arguments *a = data;
    if (!a->quiet) {
        (void)fprintf(stderr, "iteration %d: objective %.6g, optimality %.2g\n", (int)iteration,
                      objective, kkt);
    }
    return 0;
}

/* Markers as they are, muscles about as EMG says, and residual torques for what the model's muscles
 * then lack: a motion to start from, however wrong the model is. */
#define START_COSTS "costs=[{plugin: mhe.cost.emg-markers, residual_torque: 10}]"

static mhe_status out_folder(const arguments *a, const mhi_run *run, mhi_text *out,
                             mhe_error *err) {
    mhi_text_add(out, "%s%s%s", a->out != NULL ? a->out : "out/", a->out != NULL ? "" : run->name,
                 a->out != NULL ? "" : "-calibrated");
    return out->failed ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
}

/* What solves a whole motion at once, which needs no real-time iteration. */
static const char *solver_setting(const mhi_plan *plan, int32_t ipopt, mhi_arena *arena) {
    return mhi_arena_format(arena,
                            "solver={plugin: mhe.solver.%s, %smax_iterations: %d, tolerance: %g}",
                            ipopt ? "ipopt" : "rti", ipopt ? "" : "preset: robust, ",
                            (int)plan->max_iterations, fmax(1e-12, fmin(1e-4, plan->tolerance)));
}

/* The config as it is, that with the solver that section calibrate asks for, and that of the start:
 * the same start whatever the solver is, since first activations are expected near those that it
 * finds. */
static mhe_status read_run(const arguments *a, const mhe_host *host, mhi_registry *registry,
                           mhi_run **own, mhi_run **run, mhi_run **start, mhe_error *err) {
    mhi_plan plan;
    mhi_arena arena = {0};
    mhi_text model = {0};
    int32_t n = 0;
    const char **set = MHI_TAKE(&arena, const char *, a->set.n + 3);
    mhe_status status = mhi_run_read(a->config, a->set.values, a->set.n, registry, own, err);
    if (status == MHE_OK) {
        status = mhi_plan_read(*own, registry, &plan, err);
    }
    if (status == MHE_OK && set == NULL) {
        status = mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    if (status == MHE_OK && plan.scale != NULL) {
        mhi_text out = {0};
        status = out_folder(a, *own, &out, err);
        status = status == MHE_OK ? scaled_make(host, plan.scale, out.data, a->quiet, &model, err)
                                  : status;
        mhi_text_free(&out);
    }
    if (status == MHE_OK) {
        for (n = 0; n < a->set.n; n++) {
            set[n] = a->set.values[n];
        }
        if (plan.scale != NULL) {
            set[n++] = model.data;
        }
        set[n++] = solver_setting(&plan, plan.solver, &arena);
        status = mhi_run_read(a->config, set, n, registry, run, err);
        set[n - 1] = solver_setting(&plan, 0, &arena);
        set[n++] = START_COSTS;
    }
    if (status == MHE_OK) {
        status = mhi_run_read(a->config, set, n, registry, start, err);
    }
    mhi_text_free(&model);
    mhi_arena_free(&arena);
    return status;
}

static const char *path_of(const mhi_plan_recording *r) {
    return r->markers != NULL ? r->markers : r->angles != NULL ? r->angles : r->emg;
}

/* What stands behind the last `n` slashes of a path. */
static const char *behind(const char *path, int32_t n) {
    const char *at = path + strlen(path);
    while (at > path && (at[-1] != '/' || --n > 0)) {
        at--;
    }
    return at;
}

/* A recording's file, with its folder where another one has the same name. */
static const char *file_of(const mhi_plan *plan, int32_t i) {
    const char *path = path_of(&plan->recordings[i]);
    int32_t same = 0;
    for (int32_t k = 0; k < plan->n_recordings && path != NULL; k++) {
        const char *other = path_of(&plan->recordings[k]);
        same += other != NULL && strcmp(behind(path, 1), behind(other, 1)) == 0;
    }
    return path == NULL ? "" : behind(path, same > 1 ? 2 : 1);
}

/* What is known of a recording: without EMG, or without a reference, nothing is to be compared. */
static void tell_recording(const report_recording *r) {
    const struct {
        const char *what, *unit;
        double before, after, scale;
    } parts[] = {{"markers", " mm", r->before.marker, r->after.marker, 1e3},
                 {"EMG", "", r->before.emg, r->after.emg, 1},
                 {"forces", " N", r->before.force, r->after.force, 1}};
    const char *between = ":";
    (void)fprintf(stderr, "%s%s", r->name, r->held_out ? " (held out)" : "");
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++) {
        if (!isnan(parts[i].before) || !isnan(parts[i].after)) {
            (void)fprintf(stderr, "%s %s %.3g -> %.3g%s", between, parts[i].what,
                          parts[i].scale * parts[i].before, parts[i].scale * parts[i].after,
                          parts[i].unit);
            between = ",";
        }
    }
    (void)fputc('\n', stderr);
}

/* Each recording with the config as it was and with that of the person. */
static mhe_status compare(const arguments *a, const mhi_calibration *c, const char *person,
                          report_recording *list, mhe_error *err) {
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < c->plan.n_recordings && status == MHE_OK; i++) {
        const mhi_plan_recording *r = &c->plan.recordings[i];
        report_recording *one = &list[i];
        *one = (report_recording){.name = file_of(&c->plan, i), .held_out = r->hold_out};
        status =
            held_out_measure(a->config, a->set.values, a->set.n, r, c->host, &one->before, err);
        if (status == MHE_OK) {
            status = held_out_measure(person, NULL, 0, r, c->host, &one->after, err);
        }
        if (status == MHE_OK && !a->quiet) {
            tell_recording(one);
        }
    }
    return status;
}

static mhe_status write_text(mhe_outbox *box, const char *name, const mhi_text *text,
                             mhe_error *err) {
    return text->failed ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                        : mhe_outbox_text(box, name, text->data, err);
}

/* Model and config first: the comparison reads them. */
static mhe_status write_person(const mhi_calibration *c, const char *out, mhe_error *err) {
    mhi_text model = {0}, config = {0};
    mhe_outbox *box = NULL;
    mhe_status status = mhi_person_model(c, &model, err);
    if (status == MHE_OK) {
        status = mhi_person_config(c, "calibrated.osim", &config, err);
    }
    status = status == MHE_OK ? mhe_outbox_open(out, &box, err) : status;
    status = status == MHE_OK ? write_text(box, "calibrated.osim", &model, err) : status;
    status = status == MHE_OK ? write_text(box, "calibrated.yaml", &config, err) : status;
    status = status == MHE_OK ? mhe_outbox_commit(box, err) : status;
    mhe_outbox_close(box);
    mhi_text_free(&model);
    mhi_text_free(&config);
    return status;
}

static mhe_status write_report(report_content *r, const char *out, mhe_error *err) {
    mhi_text table = {0}, json = {0}, page = {0};
    mhe_outbox *box = NULL;
    report_findings(r);
    report_table(r, &table);
    report_json(r, &json);
    report_html(r, &page);
    mhe_status status = mhe_outbox_open(out, &box, err);
    status = status == MHE_OK ? write_text(box, "parameters.csv", &table, err) : status;
    status = status == MHE_OK ? write_text(box, "calibration.json", &json, err) : status;
    status = status == MHE_OK ? write_text(box, "report.html", &page, err) : status;
    status = status == MHE_OK ? mhe_outbox_commit(box, err) : status;
    mhe_outbox_close(box);
    mhi_text_free(&table);
    mhi_text_free(&json);
    mhi_text_free(&page);
    return status;
}

/* Everything that follows from a solved calibration. */
static mhe_status tell(arguments *a, mhi_calibration *c, mhe_error *err) {
    mhi_text out = {0}, person = {0};
    report_recording *recordings = MHI_TAKE(&c->arena, report_recording, c->plan.n_recordings);
    report_content r = {c, recordings, c->plan.n_recordings, {0}};
    mhe_status status = out_folder(a, c->run, &out, err);
    mhi_text_add(&person, "%s/calibrated.yaml", out.failed ? "" : out.data);
    status = status != MHE_OK                      ? status
             : person.failed || recordings == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                                                   : write_person(c, out.data, err);
    if (status == MHE_OK) {
        status = compare(a, c, person.data, recordings, err);
    }
    if (status == MHE_OK) {
        status = write_report(&r, out.data, err);
    }
    if (status == MHE_OK && r.findings.length > 0) {
        (void)fputs(r.findings.data, stderr);
    }
    if (status == MHE_OK) {
        (void)printf("results in %s\n", out.data);
    }
    mhi_text_free(&r.findings);
    mhi_text_free(&out);
    mhi_text_free(&person);
    return status;
}

static mhe_status calibrate(arguments *a, const mhe_host *host, mhi_registry *registry,
                            mhe_error *err) {
    mhi_run *own = NULL, *run = NULL, *start = NULL;
    mhi_calibration c = {.progress = NULL};
    mhe_status status = read_run(a, host, registry, &own, &run, &start, err);
    if (status == MHE_OK) {
        status = mhi_calibration_open(run, start, registry, host, &c, err);
        c.persons_solver = &own->solver;
        c.progress = show;
        c.data = a;
    }
    if (status == MHE_OK) {
        status = mhi_calibration_solve(&c, err);
    }
    if (status == MHE_OK) {
        status = tell(a, &c, err);
    }
    mhi_calibration_close(&c);
    mhi_run_free(own);
    mhi_run_free(run);
    mhi_run_free(start);
    return status;
}

int main(int argc, char **argv) {
    const mhe_host host = console_host("mhe-calibrate");
    arguments a = {0};
    mhe_error err = {0};
    mhi_registry *registry = NULL;
    int32_t command = 0, outcome = WORDS_RUN;
    mhe_status status = words_parse(&program, argc, argv, &a, &command, &outcome, &err);
    if (status == MHE_OK && outcome == WORDS_HELP) {
        mhi_text text = {0};
        words_help(&program);
        mhi_plan_describe(&text);
        status = console_print(&text, &err);
    } else if (status == MHE_OK && outcome == WORDS_RUN) {
        status = mhi_registry_create(&host, &registry, &err);
        if (status == MHE_OK) {
            status = calibrate(&a, &host, registry, &err);
        }
    }
    mhi_registry_free(registry);
    words_free(&program, &a);
    return console_end("mhe-calibrate", status, &err);
}
