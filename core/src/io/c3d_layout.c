/* SPDX-License-Identifier: Apache-2.0 */
#include "io/c3d_layout.h"

#include <math.h>

static mhe_status fail(const mhi_c3d_file *file, const char *what) {
    return mhe_fail(file->err, MHE_E_INPUT, "%s: %s", file->name, what);
}

/* One of the header's 16-bit words, counted from 0. */
static const uint8_t *word(const mhi_c3d_file *file, int32_t i) {
    return file->data + 2 * i;
}

double mhi_c3d_find_number(const mhi_c3d_file *file, const char *group, const char *name,
                           double fallback) {
    const mhi_c3d_parameter p = mhi_c3d_find(file, group, name);
    return mhi_c3d_number(file, &p, 0, 0, fallback);
}

/* Counts and places use all 16 bits. */
static double find_count(const mhi_c3d_file *file, const char *group, const char *name,
                         double fallback) {
    const mhi_c3d_parameter p = mhi_c3d_find(file, group, name);
    return mhi_c3d_number(file, &p, 0, 1, fallback);
}

/* A frame number kept as two words, low one first. */
static int64_t long_number(const mhi_c3d_file *file, const char *name, int64_t fallback) {
    const mhi_c3d_parameter p = mhi_c3d_find(file, "TRIAL", name);
    if (p.type == 4 && p.n > 0) {
        const double number = mhi_c3d_number(file, &p, 0, 0, -1);
        return number >= 0 && number <= INT32_MAX ? (int64_t)number : fallback;
    }
    if (p.type != 2 || p.n < 2) {
        return fallback;
    }
    return (int64_t)mhi_c3d_number(file, &p, 0, 1, 0) +
           65536 * (int64_t)mhi_c3d_number(file, &p, 1, 1, 0);
}

static int32_t count(double value, double most) {
    return value >= 0 && value <= most ? (int32_t)value : -1; /* NaN is none */
}

/* Frames that the file promises; the header's words end at 65535. */
static int64_t said_frames(const mhi_c3d_file *file, mhi_c3d_layout *l, int64_t *first,
                           int64_t held) {
    const int64_t from = mhi_c3d_uint16(file, word(file, 3));
    const int64_t to = mhi_c3d_uint16(file, word(file, 4));
    *first = long_number(file, "ACTUAL_START_FIELD", from);
    const int64_t last = long_number(file, "ACTUAL_END_FIELD", to);
    if (last >= *first && *first >= 0 && last <= INT32_MAX && last != to) {
        return last - *first + 1;
    }
    *first = from;
    const double longer = fmax(mhi_c3d_find_number(file, "POINT", "LONG_FRAMES", 0),
                               find_count(file, "POINT", "FRAMES", 0));
    if (longer > (double)(to - from + 1) && to == 65535 && longer < INT32_MAX) {
        return (int64_t)longer;
    }
    if (to == 65535 && held > to - from + 1) {
        l->by_size = 1;
        return held;
    }
    return to - from + 1;
}

static mhe_status read_frames(const mhi_c3d_file *file, mhi_c3d_layout *l) {
    int64_t first = 0;
    const int64_t held =
        l->start >= file->length ? 0 : (int64_t)((file->length - l->start) / l->frame_bytes);
    const int64_t said = said_frames(file, l, &first, held);
    l->lost = said > held ? said - held : 0;
    const int64_t n = said < held ? said : held;
    l->first = first < 1 ? 1 : (int32_t)first;
    l->n_frames = (int32_t)(n < INT32_MAX ? n : INT32_MAX);
    if (n < 1) {
        return fail(file, said < 1 ? "holds no frame" : "ends before its first frame");
    }
    return MHE_OK;
}

/* Samples of a channel in a frame follow from the channels' number; where that does not go into the
 * frame's words, the header's own count is taken. */
static mhe_status read_counts(const mhi_c3d_file *file, mhi_c3d_layout *l) {
    const int32_t said = mhi_c3d_uint16(file, word(file, 9));
    const int32_t words = mhi_c3d_uint16(file, word(file, 2));
    const double points = find_count(file, "POINT", "USED", mhi_c3d_uint16(file, word(file, 1)));
    const double channels = find_count(file, "ANALOG", "USED", said > 0 ? words / said : words);
    l->n_points = count(points, 65535);
    l->n_channels = words == 0 ? 0 : count(channels, 65535);
    l->per_frame = l->n_channels > 0 ? words / l->n_channels : 1;
    if (l->n_channels > 0 && l->n_channels * l->per_frame != words && said > 0 &&
        words % said == 0) {
        l->n_channels = words / said;
        l->per_frame = said;
        l->counts_differ = 1;
    }
    if (l->n_points < 0 || l->n_channels < 0 ||
        (l->n_channels > 0 && l->n_channels * l->per_frame != words)) {
        return fail(file, "POINT:USED or ANALOG:USED contradicts the header");
    }
    l->words = words;
    return l->n_points + words > 0 ? MHE_OK
                                   : fail(file, "holds neither points nor analog channels");
}

static void set_kind(mhi_c3d_layout *l, double scale) {
    l->scale = scale;
    l->is_float = scale < 0;
    l->word = l->is_float ? 4 : 2;
    l->frame_bytes = l->word * (4 * (size_t)l->n_points + (size_t)l->words);
}

/* Bytes that are left over or missing, of frames as the header counts them. */
static double misfit(const mhi_c3d_file *file, const mhi_c3d_layout *l) {
    const double n = mhi_c3d_uint16(file, word(file, 4)) - mhi_c3d_uint16(file, word(file, 3)) + 1;
    return fabs((double)file->length - (double)l->start - n * (double)l->frame_bytes);
}

/* POINT:SCALE and the header's word say the same twice. Where one of them says floats (below 0) and
 * the other integers, the file's size decides; otherwise the parameter holds. */
static mhe_status read_scale(const mhi_c3d_file *file, mhi_c3d_layout *l) {
    const double header = mhi_c3d_float(file, word(file, 6));
    const double said = mhi_c3d_find_number(file, "POINT", "SCALE", header);
    const int has_header = isfinite(header) && header != 0, has_said = isfinite(said) && said != 0;
    if (!has_header && !has_said) {
        if (l->n_points > 0) {
            return fail(file, "POINT:SCALE and the header's scale are missing or zero");
        }
        set_kind(l, -1); /* analog alone: of floats or integers, by the size */
        const double of_floats = misfit(file, l);
        set_kind(l, 1);
        set_kind(l, of_floats < misfit(file, l) ? -1 : 1);
        return MHE_OK;
    }
    set_kind(l, has_said ? said : header);
    if (has_header && has_said && (header < 0) != (said < 0)) {
        const double as_said = misfit(file, l);
        mhi_c3d_layout other = *l;
        set_kind(&other, header);
        set_kind(l, misfit(file, &other) < as_said ? header : said);
        l->scales_differ = 1;
    } else if (has_header && has_said && !l->is_float && fabs(header / said - 1) > 1e-3) {
        l->scales_differ = 1;
    }
    return MHE_OK;
}

/* Without points nothing may say their rate: the channels' rate does. */
static mhe_status read_rate(const mhi_c3d_file *file, mhi_c3d_layout *l) {
    const double rates[] = {mhi_c3d_find_number(file, "POINT", "RATE", 0),
                            mhi_c3d_float(file, word(file, 10)),
                            mhi_c3d_find_number(file, "ANALOG", "RATE", 0) / l->per_frame};
    for (size_t i = 0; i < sizeof rates / sizeof rates[0]; i++) {
        if (rates[i] >= 1e-3 && rates[i] <= 1e6) {
            l->rate = rates[i];
            return MHE_OK;
        }
    }
    return fail(file, "POINT:RATE is missing or no rate in Hz");
}

/* POINT:DATA_START, or the header's word where that is 0 or lies outside of the file. */
static mhe_status read_start(const mhi_c3d_file *file, mhi_c3d_layout *l) {
    const double header = mhi_c3d_uint16(file, word(file, 8));
    const double said = find_count(file, "POINT", "DATA_START", header);
    const double blocks = ceil((double)file->length / MHI_C3D_BLOCK);
    const double block = said >= 2 && said <= blocks ? said : header;
    if (!(block >= 1 && block <= 65535)) {
        return fail(file, "POINT:DATA_START and the header's word for it are missing or zero");
    }
    l->start = ((size_t)block - 1) * MHI_C3D_BLOCK;
    l->starts_differ = said >= 1 && header >= 1 && said != header;
    return MHE_OK;
}

mhe_status mhi_c3d_read_layout(const mhi_c3d_file *file, mhi_c3d_layout *l) {
    *l = (mhi_c3d_layout){0};
    mhe_status status = read_start(file, l);
    status = status == MHE_OK ? read_counts(file, l) : status;
    status = status == MHE_OK ? read_rate(file, l) : status;
    status = status == MHE_OK ? read_scale(file, l) : status;
    return status == MHE_OK ? read_frames(file, l) : status;
}
