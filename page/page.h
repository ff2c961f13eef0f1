/* SPDX-License-Identifier: Apache-2.0 */
/* page.h: the page, made from the files beside this one. With MHE_PAGE_RECORDED in it replaced by
 * the results of a run (JSON), it shows these; as it is, it connects to where it came from. */
#ifndef MHE_PAGE_H
#define MHE_PAGE_H

#include <stddef.h>

#define MHE_PAGE_RECORDED "id=\"recorded\">null</script>"

extern const char mhe_page[];      /* ends in NUL */
extern const size_t mhe_page_size; /* without it */

#endif
