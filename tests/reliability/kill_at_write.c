/* Kills the process at a chosen change of its result file. To be preloaded (LD_PRELOAD).
 *
 *   KILL_AT_WRITE=n   instead of the n-th change, from 1 (never, if there are fewer)
 *   KILL_TORN=1       the n-th change is begun: the pages up to the middle of it are written
 *   KILL_COUNT=path   at a normal end, write the number of changes to this file
 *
 * A change is a write, truncation or renaming of a file whose name contains ".vtkhdf". What the
 * system does with a write is not split by SIGKILL, but at pages: KILL_TORN shows that.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>
#include <unistd.h>

static long changes = 0;
static pid_t program; /* its children count on from where they were started */

__attribute__((constructor)) static void begin(void)
{
    program = getpid();
}

static int is_result(int fd)
{
    char link[64], path[4096];
    ssize_t length;

    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    length = readlink(link, path, sizeof path - 1);
    if (length < 0)
        return 0;
    path[length] = 0;
    return strstr(path, ".vtkhdf") != NULL;
}

/* Whether this is the change to be killed at. */
static int is_last(void)
{
    const char *chosen = getenv("KILL_AT_WRITE");

    changes++;
    return chosen && changes == atol(chosen);
}

/* A child that writes for the program does not outlive it. */
static void kill_here(void)
{
    kill(program, SIGKILL);
    kill(getpid(), SIGKILL);
    for (;;)
        pause();
}

/* How much of a torn write at `offset` reaches the file: up to the page boundary nearest its middle. */
static size_t torn_part(size_t n, off_t offset)
{
    const off_t page = 4096;
    off_t end;

    if (!getenv("KILL_TORN"))
        return 0;
    end = (offset + (off_t)(n / 2) + page / 2) / page * page;
    if (end <= offset || end >= offset + (off_t)n)
        return 0;
    return (size_t)(end - offset);
}

#define NEXT(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

ssize_t pwrite64(int fd, const void *data, size_t n, off64_t offset)
{
    if (is_result(fd) && is_last()) {
        n = torn_part(n, offset);
        if (n > 0)
            NEXT(pwrite64)(fd, data, n, offset);
        kill_here();
    }
    return NEXT(pwrite64)(fd, data, n, offset);
}

ssize_t pwrite(int fd, const void *data, size_t n, off_t offset)
{
    return pwrite64(fd, data, n, offset);
}

ssize_t write(int fd, const void *data, size_t n)
{
    if (is_result(fd) && is_last()) {
        n = torn_part(n, lseek(fd, 0, SEEK_CUR));
        if (n > 0)
            NEXT(write)(fd, data, n);
        kill_here();
    }
    return NEXT(write)(fd, data, n);
}

int ftruncate64(int fd, off64_t length)
{
    if (is_result(fd) && is_last())
        kill_here();
    return NEXT(ftruncate64)(fd, length);
}

int ftruncate(int fd, off_t length)
{
    return ftruncate64(fd, length);
}

int truncate(const char *path, off_t length)
{
    if (strstr(path, ".vtkhdf") && is_last())
        kill_here();
    return NEXT(truncate)(path, length);
}

int rename(const char *old, const char *new)
{
    if (strstr(old, ".vtkhdf") && is_last())
        kill_here();
    return NEXT(rename)(old, new);
}

__attribute__((destructor)) static void tell(void)
{
    const char *path = getenv("KILL_COUNT");
    FILE *file;

    if (!path || !(file = fopen(path, "w")))
        return;
    fprintf(file, "%ld\n", changes);
    fclose(file);
}
