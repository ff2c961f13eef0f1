/* SPDX-License-Identifier: Apache-2.0 */
/* table_file.c: a file's text is read at once and given back while the rows are taken from it. */
#define _DEFAULT_SOURCE /* madvise */
#include "io/slurp.h"
#include "io/table_reader.h"

#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

#define PARCEL ((size_t)8 << 20)

void mhi_table_give_back(mhi_table_reader *reader) {
    if (reader->spent == NULL || (size_t)(reader->at - reader->spent) < PARCEL) {
        return;
    }
    const size_t page = (size_t)sysconf(_SC_PAGESIZE);
    const size_t before = (page - (uintptr_t)reader->spent % page) % page;
    const size_t room = (size_t)(reader->at - reader->spent) - before;
    const size_t whole = room - room % page;
    (void)madvise(reader->spent + before, whole, MADV_DONTNEED); /* else it stays: no harm */
    reader->spent += before + whole;
}

mhe_status mhi_table_read(const char *path, mhi_table_body body, mhi_table **table,
                          mhe_error *err) {
    char *text = NULL;
    size_t length = 0;
    *table = NULL;
    mhe_status status = mhi_slurp(path, &text, &length, err);
    if (status != MHE_OK) {
        return status;
    }
    mhi_table_reader reader;
    status = mhi_table_begin(&reader, path, text, length, err);
    if (status == MHE_OK) {
        reader.spent = reader.decoded.owned != NULL ? NULL : text;
        status = body(&reader);
    }
    status = mhi_table_finish(&reader, status, table);
    free(text);
    return status;
}
