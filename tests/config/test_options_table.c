/* SPDX-License-Identifier: Apache-2.0 */
/* test_options_table.c: every fault of an option table is found and named. */
#include "config/options.h"
#include "support.h"

#include <math.h>
#include <string.h>

struct sample {
    double real;
    int32_t count, flag;
    const char *text;
    mhe_real_list reals;
};

static const mhe_option real_option =
    MHE_OPT_REAL(struct sample, real, 0.5, 0, 1, "1", "A number.");
static const mhe_option int_option = MHE_OPT_INT(struct sample, count, 3, 0, 9, "1", "A count.");
static const mhe_option bool_option = MHE_OPT_BOOL(struct sample, flag, 1, "A switch.");
static const mhe_option enum_option = MHE_OPT_ENUM(struct sample, flag, "a", "a|b", "A choice.");
static const mhe_option text_option = MHE_OPT_TEXT(struct sample, text, 0, NULL, "A text.");
static const mhe_option list_option =
    MHE_OPT_REALS(struct sample, reals, 0, -INFINITY, INFINITY, "1", "Numbers.");

static void assert_fault(const mhe_option *options, int32_t n, const char *message) {
    mhe_error err = {0};
    mhe_status status = mhi_options_check(options, n, sizeof(struct sample), &err);
    assert_string_equal(err.text, message);
    assert_int_equal(status, *message == '\0' ? MHE_OK : MHE_E_PLUGIN);
}

static void assert_fault_of_one(mhe_option option, const char *message) {
    assert_fault(&option, 1, message);
}

static void sound_tables_pass(void **state) {
    (void)state;
    const mhe_option options[] = {real_option, int_option, bool_option, text_option, list_option};
    assert_fault(options, 5, "");
    assert_fault(NULL, 0, "");
    assert_fault_of_one(enum_option, "");
}

static void missing_tables(void **state) {
    (void)state;
    assert_fault(NULL, 1, "the option table is missing");
    assert_fault(&real_option, -1, "the option table is missing");
}

static void wrong_keys(void **state) {
    (void)state;
    mhe_option o = real_option;
    o.key = NULL;
    assert_fault_of_one(o, "option 0 has no key");
    const char *keys[] = {"", "Real", "1st", "a-b", "a b", "_a", "\xc3\xa4"};
    for (size_t i = 0; i < sizeof keys / sizeof keys[0]; i++) {
        o.key = keys[i];
        char message[96];
        (void)snprintf(message, sizeof message,
                       "option '%s': the key is not made of lower-case letters, digits and '_'",
                       keys[i]);
        assert_fault_of_one(o, message);
    }
    const mhe_option twice[] = {real_option, int_option, real_option};
    assert_fault(twice, 3, "option 'real': the key occurs twice");
    o = real_option;
    o.help = "";
    assert_fault_of_one(o, "option 'real': there is no help text");
    o.help = NULL;
    assert_fault_of_one(o, "option 'real': there is no help text");
}

static void wrong_fields(void **state) {
    (void)state;
    mhe_option o = real_option;
    o.type = 0;
    assert_fault_of_one(o, "option 'real': the type is unknown");
    o.type = 99;
    assert_fault_of_one(o, "option 'real': the type is unknown");
    o = real_option;
    o.offset = sizeof(struct sample) - 4;
    assert_fault_of_one(o, "option 'real': the field lies outside the config struct");
    o.offset = UINT32_MAX - 7;
    assert_fault_of_one(o, "option 'real': the field lies outside the config struct");
    o.offset = 4;
    assert_fault_of_one(o, "option 'real': the field is not aligned");
    mhe_option overlap[] = {list_option, text_option};
    overlap[1].offset = list_option.offset + 8;
    assert_fault(overlap, 2, "option 'text': the field overlaps that of another option");
    mhe_error err = {0};
    assert_int_equal(mhi_options_check(&real_option, 1, 0, &err), MHE_E_PLUGIN);
}

static void wrong_numbers(void **state) {
    (void)state;
    mhe_option o = real_option;
    o.unit = NULL;
    assert_fault_of_one(o, "option 'real': there is no unit (\"1\" means dimensionless)");
    o = real_option;
    o.min = 2;
    assert_fault_of_one(o, "option 'real': min is not below max");
    o.min = NAN;
    assert_fault_of_one(o, "option 'real': min is not below max");
    o = real_option;
    o.real_default = 1.5;
    assert_fault_of_one(o, "option 'real': the default is out of range");
    o.real_default = NAN;
    assert_fault_of_one(o, "option 'real': the default is out of range");
    o.flags = MHE_OPT_REQUIRED; /* has no default */
    assert_fault_of_one(o, "");
    o = int_option;
    o.real_default = 1.5;
    assert_fault_of_one(o, "option 'count': the default is not a 32-bit integer");
    o.max = 1e12;
    o.real_default = 1e11;
    assert_fault_of_one(o, "option 'count': the default is not a 32-bit integer");
    o = bool_option;
    o.real_default = 2;
    assert_fault_of_one(o, "option 'flag': the default is neither 0 nor 1");
}

static void wrong_choices(void **state) {
    (void)state;
    mhe_option o = enum_option;
    o.choices = NULL;
    assert_fault_of_one(o, "option 'flag': an enum needs choices");
    o.choices = "";
    assert_fault_of_one(o, "option 'flag': a choice is empty");
    o.choices = "a||b";
    assert_fault_of_one(o, "option 'flag': a choice is empty");
    o.choices = "a|b|a";
    assert_fault_of_one(o, "option 'flag': a choice occurs twice");
    o.choices = "ab|b";
    assert_fault_of_one(o, "option 'flag': the default is none of the choices");
    o.text_default = NULL;
    assert_fault_of_one(o, "option 'flag': the default is none of the choices");
}

static void wrong_flags(void **state) {
    (void)state;
    mhe_option o = real_option;
    o.flags = 1u << 20;
    assert_fault_of_one(o, "option 'real': there are unknown flags");
    o = real_option;
    o.replaced_by = "count";
    assert_fault_of_one(o, "option 'real': replaced_by is for deprecated options alone");
    mhe_option pair[] = {real_option, real_option};
    pair[1].key = "old";
    pair[1].flags = MHE_OPT_DEPRECATED;
    assert_fault(pair, 2, "option 'old': replaced_by names no current option");
    pair[1].replaced_by = "rael";
    assert_fault(pair, 2, "option 'old': replaced_by names no current option");
    pair[1].replaced_by = "old";
    assert_fault(pair, 2, "option 'old': replaced_by names no current option");
    pair[1].replaced_by = "real";
    assert_fault(pair, 2, "");
    pair[1].flags |= MHE_OPT_REQUIRED;
    assert_fault(pair, 2, "option 'old': a deprecated option cannot be required");
    mhe_option mixed[] = {real_option, int_option};
    mixed[1].flags = MHE_OPT_DEPRECATED;
    mixed[1].replaced_by = "real";
    assert_fault(mixed, 2, "option 'count': replaced_by names an option of another type");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sound_tables_pass), cmocka_unit_test(missing_tables),
        cmocka_unit_test(wrong_keys),        cmocka_unit_test(wrong_fields),
        cmocka_unit_test(wrong_numbers),     cmocka_unit_test(wrong_choices),
        cmocka_unit_test(wrong_flags),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
