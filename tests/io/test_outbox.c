/* SPDX-License-Identifier: Apache-2.0 */
/* Can somebody else's files, links or runs spoil results, or results spoil somebody's files? */
#include "io/outbox.h"

#include "io/slurp.h"
#include "support.h"
#include <mhe/library.h>

#include <dirent.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

static const char *const names[] = {"a", "b", "c"};
static char folder[512], base[256];

static const char *path_of(const char *name) {
    static char path[1024];
    (void)snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static int make_base(void **state) {
    (void)state;
    return test_folder(base, sizeof base) == NULL;
}

/* Each test has a folder of its own. */
static int make_folder(void **state) {
    (void)state;
    static int number;
    (void)snprintf(folder, sizeof folder, "%s/%d", base, number++);
    return mkdir(folder, 0777);
}

static void put(const char *name, const char *text) {
    FILE *file = fopen(path_of(name), "w");
    assert_non_null(file);
    assert_true(fputs(text, file) >= 0 && fclose(file) == 0);
}

static void expect_text(const char *name, const char *expected) {
    char *text = NULL;
    size_t length = 0;
    assert_int_equal(mhi_slurp(path_of(name), &text, &length, NULL), MHE_OK);
    assert_string_equal(text, expected);
    free(text);
}

static int32_t count_files(void) {
    int32_t n = 0;
    DIR *dir = opendir(folder);
    assert_non_null(dir);
    while (readdir(dir) != NULL) {
        n++;
    }
    (void)closedir(dir);
    return n - 2;
}

static mhe_outbox *open_claimed(void) {
    mhe_outbox *outbox = NULL;
    mhe_error err = {0};
    if (mhe_outbox_open(folder, &outbox, &err) != MHE_OK ||
        mhe_outbox_claim(outbox, names, 3, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    return outbox;
}

static void one_run_a_folder(void **state) {
    (void)state;
    mhe_outbox *first = open_claimed(), *second = NULL;
    mhe_error err = {0};
    assert_int_equal(mhe_outbox_open(folder, &second, &err), MHE_OK);
    assert_int_equal(mhe_outbox_claim(second, names, 3, &err), MHE_E_IO);
    assert_non_null(strstr(err.text, "another run is writing its results here"));
    mhe_outbox_close(second);
    assert_int_equal(mhe_outbox_text(first, "a", "first", &err), MHE_OK);
    assert_int_equal(mhe_outbox_commit(first, &err), MHE_OK);
    mhe_outbox_close(first);
    assert_int_equal(count_files(), 1); /* the lock is gone too */
    mhe_outbox_close(open_claimed());   /* and free */
    expect_text("a", "first");
}

/* A process that is killed leaves its lock file and temporary files, but no lock. */
static void a_killed_run(void **state) {
    (void)state;
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        mhe_outbox *outbox = NULL;
        if (mhe_outbox_open(folder, &outbox, NULL) == MHE_OK &&
            mhe_outbox_claim(outbox, names, 3, NULL) == MHE_OK &&
            mhe_outbox_text(outbox, "a", "half", NULL) == MHE_OK) {
            _exit(0);
        }
        _exit(1);
    }
    int result = 1;
    assert_int_equal(waitpid(child, &result, 0), child);
    assert_int_equal(result, 0);
    assert_int_equal(count_files(), 2);
    put(".mine.tmp", "not of an outbox");
    mhe_outbox *outbox = open_claimed();
    mhe_outbox_close(outbox);
    assert_int_equal(count_files(), 1);
    expect_text(".mine.tmp", "not of an outbox");
}

/* Names that somebody could have guessed, links at the lock, at a result. */
static void planted_links(void **state) {
    (void)state;
    mhe_error err = {0};
    put("victim", "untouched");
    assert_int_equal(symlink("victim", path_of(".a.tmp")), 0);
    assert_int_equal(symlink("victim", path_of("a")), 0);
    mhe_outbox *outbox = open_claimed();
    assert_int_equal(mhe_outbox_text(outbox, "a", "result", &err), MHE_OK);
    assert_int_equal(mhe_outbox_commit(outbox, &err), MHE_OK);
    mhe_outbox_close(outbox);
    struct stat info;
    assert_true(lstat(path_of("a"), &info) == 0 && S_ISREG(info.st_mode));
    expect_text("a", "result");
    expect_text("victim", "untouched");

    assert_int_equal(symlink("victim", path_of(".mhe-lock")), 0);
    assert_int_equal(mhe_outbox_open(folder, &outbox, &err), MHE_OK);
    assert_int_equal(mhe_outbox_claim(outbox, names, 3, &err), MHE_E_IO);
    assert_non_null(strstr(err.text, ".mhe-lock: cannot be locked"));
    mhe_outbox_close(outbox);
    expect_text("victim", "untouched");
    (void)unlink(path_of(".mhe-lock"));
    assert_int_equal(mkfifo(path_of(".mhe-lock"), 0666), 0); /* must not be waited for */
    assert_int_equal(mhe_outbox_open(folder, &outbox, &err), MHE_OK);
    assert_int_equal(mhe_outbox_claim(outbox, names, 3, &err), MHE_E_IO);
    mhe_outbox_close(outbox);
}

/* A library that writes by name gets the file, not what stands under its name by then. */
static void written_by_name(void **state) {
    (void)state;
    mhe_error err = {0};
    mhi_outbox_file *file = NULL;
    put("victim", "untouched");
    mhe_outbox *outbox = open_claimed();
    assert_int_equal(mhi_outbox_add(outbox, "a", &file, &err), MHE_OK);
    FILE *again = fopen(file->open_path, "wb");
    assert_non_null(again);
    assert_true(fputs("by name", again) >= 0 && fclose(again) == 0);
    assert_int_equal(mhe_outbox_commit(outbox, &err), MHE_OK);
    mhe_outbox_close(outbox);
    expect_text("a", "by name");
}

/* A folder where a result goes: told at the claim, and where it comes later, before any rename. */
static void all_or_nothing(void **state) {
    (void)state;
    mhe_outbox *outbox = open_claimed();
    mhe_error err = {0};
    put("a", "old a");
    for (int i = 0; i < 3; i++) {
        assert_int_equal(mhe_outbox_text(outbox, names[i], "new", &err), MHE_OK);
    }
    assert_int_equal(mkdir(path_of("c"), 0777), 0);
    assert_int_equal(mhe_outbox_commit(outbox, &err), MHE_E_IO);
    assert_non_null(strstr(err.text, "c: a folder stands where a result goes"));
    mhe_outbox_close(outbox);
    expect_text("a", "old a");
    assert_int_equal(count_files(), 2);
    assert_int_equal(mhe_outbox_open(folder, &outbox, &err), MHE_OK);
    assert_int_equal(mhe_outbox_claim(outbox, names, 3, &err), MHE_E_IO);
    mhe_outbox_close(outbox);
}

static void inputs_are_spared(void **state) {
    (void)state;
    mhe_error err = {0};
    put("b", "a recording");
    assert_int_equal(symlink("b", path_of("link to it")), 0);
    mhe_outbox *outbox = open_claimed();
    assert_int_equal(mhe_outbox_spare(outbox, NULL, &err), MHE_OK);
    assert_int_equal(mhe_outbox_spare(outbox, "/nowhere", &err), MHE_OK);
    assert_int_equal(mhe_outbox_spare(outbox, path_of("b"), &err), MHE_E_ARGUMENT);
    assert_int_equal(mhe_outbox_spare(outbox, path_of("link to it"), &err), MHE_E_ARGUMENT);
    assert_non_null(strstr(err.text, "would be overwritten"));
    assert_int_equal(mhe_outbox_text(outbox, "d", "", &err), MHE_E_ARGUMENT);
    mhe_outbox_close(outbox);
    expect_text("b", "a recording");
}

static void what_is_stale(void **state) {
    (void)state;
    mhe_error err = {0};
    char *stale = NULL;
    int32_t n = 0;
    const struct timespec once[2] = {{.tv_sec = 1}, {.tv_sec = 1}};
    for (int i = 0; i < 3; i++) {
        const char *const left[] = {"a", "c", "d"}; /* d is no name of a result */
        put(left[i], "1");
        assert_int_equal(utimensat(AT_FDCWD, path_of(left[i]), once, 0), 0);
    }
    mhe_outbox *outbox = open_claimed();
    assert_int_equal(mhe_outbox_text(outbox, "a", "2", &err), MHE_OK);
    assert_int_equal(mhe_outbox_commit(outbox, &err), MHE_OK);
    assert_int_equal(mhe_outbox_stale(outbox, &stale, &n, &err), MHE_OK);
    assert_int_equal(n, 1);
    assert_string_equal(stale, "c");
    mhe_free(stale);
    mhe_outbox_close(outbox);
}

/* A folder made for a run that wrote nothing goes with it; one that was there stays. */
static void folders_of_nothing(void **state) {
    (void)state;
    mhe_error err = {0};
    mhe_outbox *outbox = NULL;
    assert_int_equal(mhe_outbox_open(path_of("new"), &outbox, &err), MHE_OK);
    assert_int_equal(mhe_outbox_claim(outbox, names, 3, &err), MHE_OK);
    mhe_outbox_close(outbox);
    assert_int_equal(count_files(), 0);
    mhe_outbox_close(open_claimed());
    assert_int_equal(access(folder, F_OK), 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test_setup(one_run_a_folder, make_folder),
                                       cmocka_unit_test_setup(a_killed_run, make_folder),
                                       cmocka_unit_test_setup(planted_links, make_folder),
                                       cmocka_unit_test_setup(written_by_name, make_folder),
                                       cmocka_unit_test_setup(all_or_nothing, make_folder),
                                       cmocka_unit_test_setup(inputs_are_spared, make_folder),
                                       cmocka_unit_test_setup(what_is_stale, make_folder),
                                       cmocka_unit_test_setup(folders_of_nothing, make_folder)};
    return cmocka_run_group_tests(tests, make_base, NULL);
}
