/* Solve a local frictional contact problem in FCLIB's layout with one of Siconos' solvers.
 *
 *     solve_fclib PROBLEM.hdf5 SOLVER STORAGE TOLERANCE MAX_ITERATIONS REACTIONS.txt
 *
 * SOLVER is a name of the table below (--list prints it), STORAGE of W is dense, blocks (3x3) or
 * sparse. The file is read with FCLIB's own library. Prints one line of `name=value` pairs: what Siconos says of
 * its solution (info 0: converged, iterations, its own error) and the processor time of its driver
 * alone. The reactions go to a file, one number a line, so that others can measure them by their
 * own definition. Status 0: the solver ran, converged or not; 1: it could not.
 */
#include <fclib.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "FrictionContactProblem.h"
#include "Friction_cst.h"
#include "NonSmoothDrivers.h"
#include "NumericsMatrix.h"
#include "SolverOptions.h"
#include "SparseBlockMatrix.h"

struct choice {
  const char *name;
  int id;
  int iterations_per_unit; /* how many of MAX_ITERATIONS make one of its own: Newton's are dearer */
};

static const struct choice choices[] = {
  {"NSGS", SICONOS_FRICTION_3D_NSGS, 1},
  {"NSGS-EXACT-ERROR", SICONOS_FRICTION_3D_NSGS, 1},
  {"NSN_AC", SICONOS_FRICTION_3D_NSN_AC, 100},
  {"NSN_FB", SICONOS_FRICTION_3D_NSN_FB, 100},
  {"NSN_NM", SICONOS_FRICTION_3D_NSN_NM, 100},
  {"PROX", SICONOS_FRICTION_3D_PROX, 100},
  {"TFP", SICONOS_FRICTION_3D_TFP, 100},
  {"DSFP", SICONOS_FRICTION_3D_DSFP, 1},
  {"VI_EG", SICONOS_FRICTION_3D_VI_EG, 1},
  {"VI_FPP", SICONOS_FRICTION_3D_VI_FPP, 1},
  {"ADMM", SICONOS_FRICTION_3D_ADMM, 1},
};
enum { n_choices = sizeof choices / sizeof choices[0] };

static const struct choice *find(const char *name)
{
  for (int i = 0; i < n_choices; i++)
    if (strcmp(choices[i].name, name) == 0)
      return &choices[i];
  return NULL;
}

static double now(void)
{
  struct timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* W as columns; FCLIB's triplets may have rows and columns exchanged, which is the same here. */
static double *dense(const struct fclib_matrix *w)
{
  size_t n = (size_t)w->n;
  double *a = calloc(n * n, sizeof *a);
  if (!a)
    return NULL;
  if (w->nz >= 0)
    for (int k = 0; k < w->nz; k++)
      a[(size_t)w->p[k] * n + (size_t)w->i[k]] += w->x[k];
  else
    for (size_t line = 0; line < n; line++)
      for (int k = w->p[line]; k < w->p[line + 1]; k++)
        if (w->nz == -1)
          a[line * n + (size_t)w->i[k]] += w->x[k];
        else
          a[(size_t)w->i[k] * n + line] += w->x[k];
  return a;
}

/* 3x3 blocks, those that are not 0. */
static NumericsMatrix *in_blocks(const double *a, size_t n)
{
  size_t points = n / 3, count = 0;
  NumericsMatrix *matrix = NM_create(NM_SPARSE_BLOCK, (int)n, (int)n);
  SparseBlockStructuredMatrix *m = matrix->matrix1;
  m->blocknumber0 = m->blocknumber1 = (unsigned)points;
  m->blocksize0 = malloc(points * sizeof *m->blocksize0);
  m->blocksize1 = malloc(points * sizeof *m->blocksize1);
  m->index1_data = malloc((points + 1) * sizeof *m->index1_data);
  m->index2_data = malloc(points * points * sizeof *m->index2_data);
  m->block = malloc(points * points * sizeof *m->block);
  for (size_t i = 0; i < points; i++) {
    m->blocksize0[i] = m->blocksize1[i] = (unsigned)(3 * (i + 1));
    m->index1_data[i] = count;
    for (size_t j = 0; j < points; j++) {
      double block[9];
      int filled = i == j;
      for (size_t k = 0; k < 9; k++) {
        block[k] = a[(3 * j + k / 3) * n + 3 * i + k % 3];
        filled = filled || block[k] != 0.0;
      }
      if (!filled)
        continue;
      m->block[count] = malloc(sizeof block);
      memcpy(m->block[count], block, sizeof block);
      m->index2_data[count++] = j;
    }
  }
  m->index1_data[points] = count;
  m->nbblocks = (unsigned)count;
  m->filled1 = points + 1;
  m->filled2 = count;
  return matrix;
}

static NumericsMatrix *in_triplets(const double *a, size_t n)
{
  NumericsMatrix *matrix = NM_create(NM_SPARSE, (int)n, (int)n);
  NM_triplet_alloc(matrix, (CS_INT)n);
  for (size_t j = 0; j < n; j++)
    for (size_t i = 0; i < n; i++)
      if (a[j * n + i] != 0.0)
        NM_entry(matrix, (int)i, (int)j, a[j * n + i]);
  return matrix;
}

static NumericsMatrix *stored(double *a, size_t n, const char *storage)
{
  NumericsMatrix *matrix = NULL;
  if (strcmp(storage, "blocks") == 0) {
    matrix = in_blocks(a, n);
  } else if (strcmp(storage, "sparse") == 0) {
    matrix = in_triplets(a, n);
  } else if (strcmp(storage, "dense") == 0) {
    matrix = NM_new();
    NM_fill(matrix, NM_DENSE, (int)n, (int)n, a);
  }
  return matrix;
}

int main(int argc, char **argv)
{
  if (argc == 2 && strcmp(argv[1], "--list") == 0) {
    for (int i = 0; i < n_choices; i++)
      puts(choices[i].name);
    return 0;
  }
  const struct choice *chosen = argc == 7 ? find(argv[2]) : NULL;
  if (!chosen) {
    fprintf(stderr, "usage: solve_fclib PROBLEM.hdf5 SOLVER STORAGE TOLERANCE MAX_ITERATIONS OUTPUT\n"
                    "       solve_fclib --list\n");
    return 1;
  }

  struct fclib_local *given = fclib_read_local(argv[1]);
  if (!given || given->spacedim != 3) {
    fprintf(stderr, "solve_fclib: %s is not a three-dimensional local problem\n", argv[1]);
    return 1;
  }
  size_t n = (size_t)given->W->n;
  double *a = dense(given->W);
  NumericsMatrix *w = a ? stored(a, n, argv[3]) : NULL;
  if (!w) {
    fprintf(stderr, "solve_fclib: no memory, or no storage called %s\n", argv[3]);
    return 1;
  }
  FrictionContactProblem *problem =
    frictionContactProblem_new_with_data(3, (int)(n / 3), w, given->q, given->mu);
  double *r = calloc(n, sizeof *r);
  double *u = calloc(n, sizeof *u);
  SolverOptions *options = solver_options_create(chosen->id);
  if (!r || !u || !options) {
    fprintf(stderr, "solve_fclib: no memory\n");
    return 1;
  }
  options->dparam[SICONOS_DPARAM_TOL] = strtod(argv[4], NULL);
  options->iparam[SICONOS_IPARAM_MAX_ITER] = atoi(argv[5]) / chosen->iterations_per_unit;
  if (strcmp(chosen->name, "NSGS-EXACT-ERROR") == 0)
    options->iparam[SICONOS_FRICTION_3D_IPARAM_ERROR_EVALUATION] =
      SICONOS_FRICTION_3D_NSGS_ERROR_EVALUATION_FULL;

  double start = now();
  int info = fc3d_driver(problem, r, u, options);
  double seconds = now() - start;

  FILE *output = fopen(argv[6], "w");
  if (!output) {
    fprintf(stderr, "solve_fclib: cannot write %s\n", argv[6]);
    return 1;
  }
  for (size_t i = 0; i < n; i++)
    fprintf(output, "%.17g\n", r[i]);
  fclose(output);
  printf("solver=%s storage=%s info=%d iterations=%d error=%.6e seconds=%.6f\n", chosen->name,
         argv[3], info, options->iparam[SICONOS_IPARAM_ITER_DONE],
         options->dparam[SICONOS_DPARAM_RESIDU], seconds);
  return 0;
}
