/* SPDX-License-Identifier: Apache-2.0 */
/* replay.c: runs a fuzz target over every file of the folders named, without libFuzzer. */
#include "fuzz.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>

/* Returns 1 where the file was run. The copy has exactly its size, so that sanitizers see overruns.
 */
static int run_file(const char *path) {
    struct stat info;
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        return 0;
    }
    int done = 0;
    if (fstat(fileno(file), &info) == 0 && S_ISREG(info.st_mode)) {
        size_t size = (size_t)info.st_size;
        uint8_t *data = malloc(size > 0 ? size : 1);
        if (data != NULL && fread(data, 1, size, file) == size) {
            done = LLVMFuzzerTestOneInput(data, size) == 0;
        }
        free(data);
    }
    (void)fclose(file);
    return done;
}

static int run_folder(const char *path) {
    DIR *folder = opendir(path);
    int n = 0;
    if (folder == NULL) {
        return 0;
    }
    for (const struct dirent *entry = readdir(folder); entry != NULL; entry = readdir(folder)) {
        char file[4096];
        int length = snprintf(file, sizeof file, "%s/%s", path, entry->d_name);
        n += length > 0 && (size_t)length < sizeof file && run_file(file);
    }
    (void)closedir(folder);
    return n;
}

int main(int argc, char **argv) {
    int n = 0;
    for (int i = 1; i < argc; i++) {
        n += run_folder(argv[i]);
    }
    (void)printf("%d inputs\n", n);
    return n > 0 ? EXIT_SUCCESS : EXIT_FAILURE; /* an empty corpus tests nothing */
}
