/* SPDX-License-Identifier: Apache-2.0 */
/* lsl_library.h: Lab Streaming Layer's library, loaded when it is needed. Shared by the plugins
 * that speak it.
 *
 * The functions are those of liblsl's C interface, unchanged since version 1.10 (Kothe et al.,
 * labstreaminglayer.org; MIT licence). Where the system has none, the one that lies beside the
 * plugins is taken. */
#ifndef LSL_LIBRARY_H
#define LSL_LIBRARY_H

#include <mhe/abi.h>

typedef struct lsl_streaminfo_struct_ *lsl_streaminfo;
typedef struct lsl_inlet_struct_ *lsl_inlet;
typedef struct lsl_outlet_struct_ *lsl_outlet;
typedef struct lsl_xml_ptr_struct_ *lsl_xml_ptr;
typedef struct lsl_continuous_resolver_ *lsl_continuous_resolver;

enum { lsl_float32 = 1, lsl_double64, lsl_string, lsl_int32, lsl_int16, lsl_int8, lsl_int64 };
enum { lsl_no_error = 0, lsl_timeout_error = -1, lsl_lost_error = -2 };
#define LSL_DEDUCED_TIMESTAMP (-1.0)

/* Name, result, arguments. */
#define LSL_FUNCTIONS(X)                                                                        \
    X(library_version, int32_t, (void))                                                         \
    X(local_clock, double, (void))                                                              \
    X(create_continuous_resolver_bypred, lsl_continuous_resolver,                               \
      (const char *predicate, double forget_after))                                             \
    X(resolver_results, int32_t,                                                                \
      (lsl_continuous_resolver resolver, lsl_streaminfo * found, uint32_t room))                \
    X(destroy_continuous_resolver, void, (lsl_continuous_resolver resolver))                    \
    X(create_inlet, lsl_inlet,                                                                  \
      (lsl_streaminfo info, int32_t seconds, int32_t chunk, int32_t recover))                   \
    X(destroy_inlet, void, (lsl_inlet inlet))                                                   \
    X(get_fullinfo, lsl_streaminfo, (lsl_inlet inlet, double timeout, int32_t *code))           \
    X(open_stream, void, (lsl_inlet inlet, double timeout, int32_t *code))                      \
    X(time_correction, double, (lsl_inlet inlet, double timeout, int32_t *code))                \
    X(pull_chunk_d, unsigned long,                                                              \
      (lsl_inlet inlet, double *data, double *stamps, unsigned long room,                       \
       unsigned long stamps_room, double timeout, int32_t *code))                               \
    X(create_streaminfo, lsl_streaminfo,                                                        \
      (const char *name, const char *type, int32_t channels, double rate, int32_t format,       \
       const char *source_id))                                                                  \
    X(destroy_streaminfo, void, (lsl_streaminfo info))                                          \
    X(get_name, const char *, (lsl_streaminfo info))                                            \
    X(get_type, const char *, (lsl_streaminfo info))                                            \
    X(get_uid, const char *, (lsl_streaminfo info))                                             \
    X(get_hostname, const char *, (lsl_streaminfo info))                                        \
    X(get_channel_count, int32_t, (lsl_streaminfo info))                                        \
    X(get_nominal_srate, double, (lsl_streaminfo info))                                         \
    X(get_channel_format, int32_t, (lsl_streaminfo info))                                       \
    X(get_desc, lsl_xml_ptr, (lsl_streaminfo info))                                             \
    X(child, lsl_xml_ptr, (lsl_xml_ptr node, const char *name))                                 \
    X(next_sibling_n, lsl_xml_ptr, (lsl_xml_ptr node, const char *name))                        \
    X(empty, int32_t, (lsl_xml_ptr node))                                                       \
    X(child_value_n, const char *, (lsl_xml_ptr node, const char *name))                        \
    X(append_child, lsl_xml_ptr, (lsl_xml_ptr node, const char *name))                          \
    X(append_child_value, lsl_xml_ptr, (lsl_xml_ptr node, const char *name, const char *value)) \
    X(create_outlet, lsl_outlet, (lsl_streaminfo info, int32_t chunk, int32_t seconds))         \
    X(destroy_outlet, void, (lsl_outlet outlet))                                                \
    X(push_sample_dtp, int32_t,                                                                 \
      (lsl_outlet outlet, const double *data, double stamp, int32_t through))

typedef struct lsl_library {
#define LSL_FIELD(name, result, arguments) result(*name) arguments;
    LSL_FUNCTIONS(LSL_FIELD)
#undef LSL_FIELD
} lsl_library;

/* Loads `path`, or where it is NULL the first there is of liblsl.so.2, liblsl.so, liblsl64.so (the
 * system's) and lib/liblsl64.so beside this plugin. Once loaded it stays. MHE_E_IO: none, with
 * where it was looked for. [cold] */
mhe_status lsl_load(const char *path, lsl_library *out, mhe_error *err);

#endif
