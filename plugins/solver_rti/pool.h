/* SPDX-License-Identifier: Apache-2.0 */
/* pool.h: a few threads that share the items of a loop.
 *
 * The caller is worker 0 and does its part; items are handed out one by one, in their order, to
 * whoever is free. Which worker does which item is chance: what an item computes may not depend on
 * it. A thread that finds nothing to do spins for a given time and then sleeps; so does the caller
 * while it waits for the last items. */
#ifndef POOL_H
#define POOL_H

#include <stdint.h>

typedef struct rti_pool rti_pool;

/* Starts n_workers - 1 threads, or as many as the system allows; they spin for `spin` seconds. NULL
 * where there is nothing to start, or no memory: rti_pool_run() then does all itself. [cold] */
rti_pool *rti_pool_create(int32_t n_workers, double spin);
/* Ends the threads. NULL is fine. [cold] */
void rti_pool_destroy(rti_pool *pool);
/* Calls work(data, worker, item) for the items 0 .. n_items-1 and returns when all calls have.
 * After one that gave non-zero no more items are handed out; those before it are done. [cold] */
void rti_pool_run(rti_pool *pool, int32_t n_items,
                  int32_t (*work)(void *data, int32_t worker, int32_t item), void *data);

#endif
