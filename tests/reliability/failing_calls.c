/* A library to be preloaded (LD_PRELOAD), which makes the machine fail at a chosen call:
 *
 *   FAIL_ALLOCATION=k   the k-th allocation (from 1) that the program itself asks for fails; with
 *                       FAIL_ALLOCATION_FROM=bytes only those of at least so many bytes count
 *   FAIL_IN=name        allocations that libraries with that in their names ask for, instead of
 *                       the program's own
 *   FAIL_WRITE=k        the k-th write to a file on a disk and all later ones fail with the error
 *                       FAIL_ERRNO (a number: ENOSPC, EDQUOT, EIO), as on a full disk
 *   COUNT_CALLS=file    at the end the numbers of allocations and of writes go to that file
 *
 * Other libraries' allocations are left alone: how the C library bears the lack of memory is not the
 * program's to mend.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>

extern void *__libc_malloc(size_t);
extern void *__libc_realloc(void *, size_t);
extern void *__libc_calloc(size_t, size_t);

enum { most_parts = 64 };
static char *part_begin[most_parts], *part_end[most_parts]; /* of the watched code, in memory */
static int parts;
static long allocations, writes, fail_allocation, fail_write;
static size_t allocations_from;
static int fail_errno = ENOSPC;

static long number(const char *name)
{
  const char *text = getenv(name);
  return text ? atol(text) : 0;
}

/* Where the watched code is, from the map of the process. */
__attribute__((constructor)) static void prepare(void)
{
  char line[8192], self[4096];
  const char *wanted = getenv("FAIL_IN");
  ssize_t length = readlink("/proc/self/exe", self, sizeof self - 1);
  FILE *maps = fopen("/proc/self/maps", "r");

  if (length < 0 || !maps) return;
  self[length] = 0;
  if (!wanted) wanted = self;
  while (fgets(line, sizeof line, maps) && parts < most_parts) {
    unsigned long first, last;
    if (sscanf(line, "%lx-%lx", &first, &last) < 2 || !strstr(line, wanted)) continue;
    part_begin[parts] = (char *)first;
    part_end[parts++] = (char *)last;
  }
  fclose(maps);
  allocations_from = (size_t)number("FAIL_ALLOCATION_FROM");
  fail_write = number("FAIL_WRITE");
  if (getenv("FAIL_ERRNO")) fail_errno = (int)number("FAIL_ERRNO");
  fail_allocation = number("FAIL_ALLOCATION");
}

static int allocation_fails(size_t bytes, void *caller)
{
  int i;

  for (i = 0; i < parts; i++)
    if ((char *)caller >= part_begin[i] && (char *)caller < part_end[i]) break;
  if (i == parts || bytes < allocations_from) return 0;
  if (++allocations != fail_allocation) return 0;
  errno = ENOMEM;
  return 1;
}

void *malloc(size_t bytes)
{
  if (allocation_fails(bytes, __builtin_return_address(0))) return NULL;
  return __libc_malloc(bytes);
}

void *calloc(size_t n, size_t bytes)
{
  if (allocation_fails(n * bytes, __builtin_return_address(0))) return NULL;
  return __libc_calloc(n, bytes);
}

void *realloc(void *old, size_t bytes)
{
  if (allocation_fails(bytes, __builtin_return_address(0))) return NULL;
  return __libc_realloc(old, bytes);
}

static int write_fails(int descriptor)
{
  struct stat found;
  if (descriptor <= STDERR_FILENO || fstat(descriptor, &found) != 0 || !S_ISREG(found.st_mode)) return 0;
  writes++;
  if (fail_write == 0 || writes < fail_write) return 0;
  errno = fail_errno;
  return 1;
}

ssize_t write(int descriptor, const void *bytes, size_t length)
{
  static ssize_t (*real)(int, const void *, size_t);
  if (!real) real = (ssize_t (*)(int, const void *, size_t))dlsym(RTLD_NEXT, "write");
  return write_fails(descriptor) ? -1 : real(descriptor, bytes, length);
}

ssize_t pwrite64(int descriptor, const void *bytes, size_t length, off64_t at)
{
  static ssize_t (*real)(int, const void *, size_t, off64_t);
  if (!real) real = (ssize_t (*)(int, const void *, size_t, off64_t))dlsym(RTLD_NEXT, "pwrite64");
  return write_fails(descriptor) ? -1 : real(descriptor, bytes, length, at);
}

ssize_t pwrite(int descriptor, const void *bytes, size_t length, off_t at)
{
  return pwrite64(descriptor, bytes, length, at);
}

/* A program that ends by _exit runs no destructor: the counts are of runs that end by exit. */
__attribute__((destructor)) static void tell(void)
{
  const char *path = getenv("COUNT_CALLS");
  FILE *file = path ? fopen(path, "w") : NULL;
  if (!file) return;
  fprintf(file, "%ld %ld\n", allocations, writes);
  fclose(file);
}
