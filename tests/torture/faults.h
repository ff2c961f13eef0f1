/* SPDX-License-Identifier: Apache-2.0 */
/* faults.h: the k-th allocation of a program fails. Part of a test, or (faults.c alone as a library
 * that is loaded before all others) of any program:
 *
 *     TORTURE_ALLOCATION=123[+]   number 123 fails, from 1; with '+' all from there on, too
 *     TORTURE_COUNT=FILE          at its end the program leaves the number of its allocations there
 *     TORTURE_TRACE=FILE          and where the first failing one was asked for */
#ifndef FAULTS_H
#define FAULTS_H

/* From now on the k-th allocation fails (0: none), `onwards`: and all behind it. */
void faults_arm(long k, int onwards);
/* Nothing fails any more. -> how many allocations there were since faults_arm. */
long faults_disarm(void);

#endif
