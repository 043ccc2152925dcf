/* The frame of AFL++ around try_deck, for a compiler that AFL's own wrappers do not know.
 *
 * gfortran -fsanitize-coverage=trace-pc calls __sanitizer_cov_trace_pc at every branch; it counts
 * the pairs of places passed in AFL's map. The rest is AFL's runtime (afl-compiler-rt.o). With file
 * names as arguments each is tried once: so a deck that AFL has kept is looked at again.
 */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

extern uint8_t *__afl_area_ptr;
extern unsigned int *__afl_fuzz_len;
extern unsigned char *__afl_fuzz_ptr;
extern int __afl_persistent_loop(unsigned int);
extern void __afl_manual_init(void);
extern int try_deck(const char *bytes, int n, char *said, int room, int *length);

int __afl_sharedmem_fuzzing = 1;
/* AFL looks for these in the file of the program. */
const char *const persistent_mark = "##SIG_AFL_PERSISTENT##";
const char *const deferred_mark = "##SIG_AFL_DEFER_FORKSRV##";

enum { map_mask = 0xffff, largest = 1 << 16, room = 1 << 16 };

void __sanitizer_cov_trace_pc(void)
{
  static uintptr_t before;
  uintptr_t place = (uintptr_t)__builtin_return_address(0);
  place = (place >> 4) ^ (place << 8);
  __afl_area_ptr[(place ^ before) & map_mask]++;
  before = place >> 1;
}

/* Try a deck; a refusal without a proper message is a crash of its own. */
static int try_once(const char *bytes, int n)
{
  static char said[room];
  int length = 0;
  int status = try_deck(bytes, n, said, room - 1, &length);
  said[length] = 0;
  if (status == 1 && !strstr(said, "error: ")) abort();
  return status;
}

static int try_file(const char *path)
{
  static char bytes[largest];
  FILE *file = fopen(path, "rb");
  size_t n;
  if (!file) return 1;
  n = fread(bytes, 1, sizeof bytes, file);
  fclose(file);
  printf("%s: exit status %d\n", path, try_once(bytes, (int)n));
  return 0;
}

int main(int n_arguments, char **arguments)
{
  int i;
  if (n_arguments > 1) {
    for (i = 1; i < n_arguments; i++)
      if (try_file(arguments[i])) return 1;
    return 0;
  }
  __afl_manual_init();
  while (__afl_persistent_loop(2000)) {
    int n = (int)*__afl_fuzz_len;
    if (n > 0 && n <= largest) try_once((const char *)__afl_fuzz_ptr, n);
  }
  return persistent_mark[0] + deferred_mark[0] == 0;
}
