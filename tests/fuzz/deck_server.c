/* Tries decks from standard input, one after the other in one process: fuzz_decks.py --server.
 *
 * A deck comes as its length (4 bytes, in the machine's order) and its bytes; the answer is the exit
 * status, the length of what was said, and what was said. The process ends with its input, or where
 * the program would: a crash, no memory.
 */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

enum { room = 1 << 20, largest = 1 << 28 };

extern int try_deck(const char *bytes, int n, char *said, int room, int *length);

int main(void)
{
  static char said[room];
  int32_t n, answer[2];

  while (fread(&n, sizeof n, 1, stdin) == 1 && n >= 0 && n <= largest) {
    char *bytes = malloc((size_t)n + 1);
    int length = 0;
    if (!bytes || fread(bytes, 1, (size_t)n, stdin) != (size_t)n) return 1;
    answer[0] = try_deck(bytes, n, said, room, &length);
    answer[1] = length;
    free(bytes);
    fwrite(answer, sizeof answer, 1, stdout);
    fwrite(said, 1, (size_t)length, stdout);
    if (fflush(stdout) != 0) return 1;
  }
  return 0;
}
