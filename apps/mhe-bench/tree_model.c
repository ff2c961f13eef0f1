/* SPDX-License-Identifier: Apache-2.0 */
#include "tree_model.h"

#include "base/pi.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define JOINTS_MAX 40
#define DURATION 1.5 /* s */
#define RATE 100     /* Hz */

/* One segment and the joint that it hangs from. */
typedef struct joint {
    char name[16];
    int32_t parent;  /* -1: the ground */
    int32_t n_axes;  /* degrees of freedom */
    int32_t depth;   /* of a limb: 0 next to the trunk */
    double at[3];    /* in the parent's frame, m */
    double length;   /* down along -z, m */
    double mass;     /* kg */
    double strength; /* N, of one muscle */
    int32_t n_muscles;
} joint;

typedef struct tree {
    joint joints[JOINTS_MAX];
    int32_t n_joints;
    uint64_t seed;
} tree;

static double uniform(tree *t, double low, double high) {
    t->seed = t->seed * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * (double)(t->seed >> 11) * 0x1p-53;
}

static int32_t add_joint(tree *t, const joint *j) {
    t->joints[t->n_joints] = *j;
    (void)snprintf(t->joints[t->n_joints].name, sizeof j->name, "S%d", (int)t->n_joints);
    return t->n_joints++;
}

static void add_limb(tree *t, const char *joints, int32_t number, int32_t trunk) {
    static const double length[] = {0.42, 0.42, 0.10, 0.18}, mass[] = {8, 3.6, 0.9, 0.3};
    static const double strength[] = {600, 450, 160, 60};
    int32_t parent = trunk;
    const int32_t low = number < 2 && trunk >= 0; /* legs before arms */
    for (int32_t i = 0; joints[i] != '\0'; i++) {
        const int32_t depth = i < 4 ? i : 3;
        joint j = {.parent = parent,
                   .n_axes = joints[i] - '0',
                   .depth = depth,
                   .length = length[depth],
                   .mass = mass[depth],
                   .strength = strength[depth]};
        if (i > 0) {
            j.at[2] = -t->joints[parent].length;
        } else if (trunk >= 0) {
            j.at[1] = (number % 2 == 0 ? 0.12 : -0.12) * (1 + 0.8 * (number / 2));
            j.at[2] = low ? -t->joints[trunk].length : -0.05;
        }
        parent = add_joint(t, &j);
    }
}

static void plant(const tree_size *size, tree *t) {
    int32_t trunk = -1, number = 0, degrees = 0;
    *t = (tree){.seed = 1};
    for (int32_t i = 0; i < TREE_LIMBS_MAX && size->limbs[i] != NULL; i++) {
        if (size->limbs[i][0] == 't') {
            const joint j = {.parent = -1,
                             .n_axes = size->limbs[i][1] - '0',
                             .length = 0.4,
                             .mass = 25,
                             .strength = 600};
            trunk = add_joint(t, &j);
        } else {
            add_limb(t, size->limbs[i], number++, trunk);
        }
    }
    for (int32_t i = 0; i < t->n_joints; i++) {
        degrees += t->joints[i].n_axes;
    }
    /* Two muscles a degree of freedom, the others in turn. */
    int32_t left = size->muscles;
    for (int32_t i = 0; i < t->n_joints && 2 * degrees <= size->muscles; i++) {
        t->joints[i].n_muscles = 2 * t->joints[i].n_axes;
        left -= t->joints[i].n_muscles;
    }
    for (int32_t i = 0; left > 0; i = (i + 1) % t->n_joints, left--) {
        t->joints[i].n_muscles++;
    }
}

int32_t tree_coordinates(const tree_size *size) {
    int32_t n = 0;
    for (int32_t i = 0; i < TREE_LIMBS_MAX && size->limbs[i] != NULL; i++) {
        for (const char *c = size->limbs[i]; *c != '\0'; c++) {
            n += *c == 't' ? 0 : *c - '0';
        }
    }
    return n;
}

static const char *parent_name(const tree *t, const joint *j) {
    return j->parent < 0 ? "Base" : t->joints[j->parent].name;
}

static void write_segment(FILE *file, const tree *t, const joint *j) {
    static const char *const axes[] = {"", "y", "xy", "xyz"};
    const double r = 0.06, m = j->mass, l = j->length;
    const double across = fmax(m * (3 * r * r + l * l) / 12, 1.5e-3),
                 along = fmax(m * r * r / 2, 8e-4);
    (void)fprintf(file,
                  "segment %s\n\tparent %s\n\trtinmatrix 0\n\trt 0 0 0 xyz %.4f %.4f %.4f\n"
                  "\trotations %s\n\tranges\n",
                  j->name, parent_name(t, j), j->at[0], j->at[1], j->at[2], axes[j->n_axes]);
    for (int32_t i = 0; i < j->n_axes; i++) {
        (void)fprintf(file, "\t\t-2.5 2.5\n");
    }
    (void)fprintf(file,
                  "\tmass %.4f\n\tinertia\n\t%.6f 0 0\n\t0 %.6f 0\n\t0 0 %.6f\n\tcom 0 0 %.4f\n"
                  "endsegment\n",
                  m, across, across, along, -0.45 * l);
}

static void write_markers(FILE *file, const tree *t) {
    static const double place[3][3] = {{0.05, 0, -0.2}, {0, 0.05, -0.6}, {-0.04, -0.04, -0.95}};
    for (int32_t i = 0; i < 3 * t->n_joints; i++) {
        const joint *j = &t->joints[i / 3];
        const double *p = place[i % 3];
        (void)fprintf(file, "marker m%d\n\tparent %s\n\tposition %.4f %.4f %.4f\nendmarker\n",
                      (int)i, j->name, p[0], p[1], p[2] * j->length);
    }
}

static double distance(const double *a, const double *b) {
    return hypot(hypot(a[0] - b[0], a[1] - b[1]), a[2] - b[2]);
}

/* Around the joint, through a point beside it; those of a hinge before and behind its axis. */
static void write_muscle(FILE *file, tree *t, const joint *j, int32_t i, int32_t number) {
    const double r = j->depth < 2 ? 0.04 : 0.022, rise = j->depth < 2 ? 0.14 : 0.12;
    const double side = i % 2 == 0 ? 1 : -1;
    double angle = 2 * MHI_PI * (i + uniform(t, 0, 0.3)) / j->n_muscles;
    double twist = (j->n_axes == 3 ? 0.8 : 0.2) * side;
    if (j->n_axes == 1) {
        angle = (side > 0 ? MHI_PI : 0) + uniform(t, -0.175, 0.175);
        twist = uniform(t, -0.05, 0.05);
    }
    const double origin[3] = {j->at[0] + r * cos(angle), j->at[1] + r * sin(angle),
                              j->at[2] + rise};
    const double via[3] = {j->at[0] + 1.1 * r * cos(angle), j->at[1] + 1.1 * r * sin(angle),
                           j->at[2] + 0.002};
    const double end[3] = {0.8 * r * cos(angle + twist), 0.8 * r * sin(angle + twist),
                           -0.35 * j->length};
    const double insertion[3] = {j->at[0] + end[0], j->at[1] + end[1], j->at[2] + end[2]};
    const double length = distance(origin, via) + distance(via, insertion), fiber = 0.62 * length;
    (void)fprintf(file,
                  "muscle mu%d\n\ttype hilldegroote\n\tmusclegroup g%s\n"
                  "\tOriginPosition %.5f %.5f %.5f\n\tInsertionPosition %.5f %.5f %.5f\n"
                  "\toptimalLength %.5f\n\tmaximalForce %.1f\n\ttendonSlackLength %.5f\n"
                  "\tpennationAngle 0\nendmuscle\n",
                  (int)number, j->name, origin[0], origin[1], origin[2], end[0], end[1], end[2],
                  fiber, j->strength * uniform(t, 0.95, 1.05), length - 0.85 * fiber);
    (void)fprintf(file,
                  "viapoint v%d\n\tparent %s\n\tmuscle mu%d\n\tmusclegroup g%s\n"
                  "\tposition %.5f %.5f %.5f\nendviapoint\n",
                  (int)number, parent_name(t, j), (int)number, j->name, via[0], via[1], via[2]);
}

static void write_model(FILE *file, tree *t) {
    int32_t number = 0;
    (void)fprintf(file, "version 4\ngravity 0 0 -9.81\nsegment Base\n\trtinmatrix 0\n"
                        "\trt 0 0 0 xyz 0 0 0\n\tmass 1\n\tinertia\n\t1 0 0\n\t0 1 0\n\t0 0 1\n"
                        "\tcom 0 0 0\nendsegment\n");
    for (int32_t i = 0; i < t->n_joints; i++) {
        write_segment(file, t, &t->joints[i]);
    }
    write_markers(file, t);
    for (int32_t i = 0; i < t->n_joints; i++) {
        const joint *j = &t->joints[i];
        (void)fprintf(file,
                      "musclegroup g%s\n\tOriginParent %s\n\tInsertionParent %s\nendmusclegroup\n",
                      j->name, parent_name(t, j), j->name);
        for (int32_t k = 0; k < j->n_muscles; k++) {
            write_muscle(file, t, j, k, number++);
        }
    }
}

static void write_excitations(FILE *file, tree *t, int32_t muscles) {
    const int32_t rows = (int32_t)(DURATION * RATE) + 1;
    (void)fprintf(file, "excitations\nversion=1\nnRows=%d\nnColumns=%d\ninDegrees=no\nendheader\n",
                  (int)rows, (int)muscles + 1);
    (void)fprintf(file, "time");
    for (int32_t m = 0; m < muscles; m++) {
        (void)fprintf(file, "\tmu%d", (int)m);
    }
    const uint64_t seed = t->seed;
    for (int32_t k = 0; k < rows; k++) {
        const double time = (double)k / RATE;
        t->seed = seed; /* each row draws the same waves */
        (void)fprintf(file, "\n%.2f", time);
        for (int32_t m = 0; m < muscles; m++) {
            const double rate = uniform(t, 0.4, 1.6), phase = uniform(t, 0, 2 * MHI_PI);
            const double wave = 1 + sin(2 * MHI_PI * rate * time + phase);
            (void)fprintf(file, "\t%.6f", 0.04 + uniform(t, 0.01, 0.03) * wave);
        }
    }
    (void)fprintf(file, "\n");
}

static void write_simulation(FILE *file, tree *t, int32_t coordinates) {
    (void)fprintf(file, "model: {file: model.bioMod}\nmuscle: {curves: degroote2016}\n"
                        "initial: {q: [");
    for (int32_t i = 0; i < coordinates; i++) {
        (void)fprintf(file, "%s%.4f", i > 0 ? ", " : "", uniform(t, -0.08, 0.08));
    }
    (void)fprintf(file, "], qdot: [");
    for (int32_t i = 0; i < coordinates; i++) {
        (void)fprintf(file, "%s0", i > 0 ? ", " : "");
    }
    (void)fprintf(file, "]}\ncosts: [mhe.cost.min-excitation]\n");
}

static void write_bench(FILE *file) {
    (void)fprintf(file,
                  "model: {file: model.bioMod}\nmuscle: {curves: degroote2016}\n"
                  "data: {markers: sim/markers.trc, emg: sim/emg.sto, reference: "
                  "sim/reference.sto}\nhorizon: {window: 7, ratio: 3}\n"
                  "costs: [mhe.cost.emg-markers-high]\n"
                  "integrator: {plugin: mhe.integrator.rk, tolerance: 0, stages: 2, max_step: "
                  "0.03, activation_step: 3.4}\n"
                  "solver: {plugin: mhe.solver.rti, preset: speed}\n");
}

mhe_status tree_write(const tree_size *size, const char *folder, mhe_error *err) {
    static const char *const names[] = {"model.bioMod", "excitations.sto", "sim.yaml",
                                        "bench.yaml"};
    tree t;
    plant(size, &t);
    for (int32_t i = 0; i < 4; i++) {
        char path[4096];
        (void)snprintf(path, sizeof path, "%s/%s", folder, names[i]);
        FILE *file = fopen(path, "w");
        if (file == NULL) {
            return mhe_fail(err, MHE_E_INPUT, "%s: cannot be written", path);
        }
        if (i == 0) {
            write_model(file, &t);
        } else if (i == 1) {
            write_excitations(file, &t, size->muscles);
        } else if (i == 2) {
            write_simulation(file, &t, tree_coordinates(size));
        } else {
            write_bench(file);
        }
        const int bad = ferror(file);
        if (fclose(file) != 0 || bad) {
            return mhe_fail(err, MHE_E_INPUT, "%s: cannot be written", path);
        }
    }
    return MHE_OK;
}
