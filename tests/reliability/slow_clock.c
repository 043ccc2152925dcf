/* A clock that goes on by LOOK milliseconds whenever it is looked at, and not otherwise: a machine
 * as slow or as fast as one likes, and a count of the looks. To be preloaded (LD_PRELOAD).
 *
 *   SIGNAL_AT=n       SIGTERM at the n-th look at any clock, from 1 (never, if there are fewer)
 *   SIGNAL_CUT=1      the second that the program has to stop in order is over at once
 *   LOOK_COUNT=path   at a normal end, write the number of looks to this file
 *
 * The program looks at clocks where its phases begin and end: plan, step, increment, reactions,
 * estimates, certificate, file.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <sys/types.h>
#include <time.h>
#include <unistd.h>

static long looks = 0;
static pid_t program; /* looks of its children do not count */

__attribute__((constructor)) static void begin(void)
{
    program = getpid();
}

__attribute__((destructor)) static void end(void)
{
    const char *path = getenv("LOOK_COUNT");
    FILE *file = path && getpid() == program ? fopen(path, "w") : NULL;

    if (file) {
        fprintf(file, "%ld\n", looks);
        fclose(file);
    }
}

static void look(void)
{
    const char *chosen = getenv("SIGNAL_AT");

    if (getpid() != program || ++looks != (chosen ? atol(chosen) : 0))
        return;
    raise(SIGTERM);
    if (getenv("SIGNAL_CUT"))
        raise(SIGALRM);
}

int clock_gettime(clockid_t clock, struct timespec *now)
{
    static int (*real)(clockid_t, struct timespec *);
    static long long slow = 0;
    const char *step = getenv("LOOK");

    look();
    if (!real)
        real = (int (*)(clockid_t, struct timespec *))dlsym(RTLD_NEXT, "clock_gettime");
    if (clock == CLOCK_MONOTONIC && step) {
        long long milliseconds = ++slow * atoll(step);

        now->tv_sec = (time_t)(milliseconds / 1000);
        now->tv_nsec = (long)(milliseconds % 1000) * 1000000;
        return 0;
    }
    return real(clock, now);
}

int getrusage(__rusage_who_t who, struct rusage *usage)
{
    static int (*real)(__rusage_who_t, struct rusage *);

    look();
    if (!real)
        real = (int (*)(__rusage_who_t, struct rusage *))dlsym(RTLD_NEXT, "getrusage");
    return real(who, usage);
}
