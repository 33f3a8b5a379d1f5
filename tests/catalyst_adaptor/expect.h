/* Checks of the codes that the adaptor's calls return, isolated runs included. */
#ifndef VDI_TESTS_CATALYST_EXPECT_H
#define VDI_TESTS_CATALYST_EXPECT_H

#include <stdio.h>

#include "catalyst_adaptor/vdi_catalyst.h"

/* These functions return 1, and say why, if a code isn't the expected one. */
static int expect(int rank, const char* what, int wanted, int code) {
  if (code == wanted) return 0;
  fprintf(stderr, "rank %d: %s returned %d, not %d\n", rank, what, code, wanted);
  return 1;
}

/* In processes of their own, frames are made later. The code of one that failed comes from a later call. */
static int is_late;
static int has_failed; /* a frame was to fail */
static int is_untold;  /* and no later call has returned that */

static int expect_step(int rank, int wanted, int code) {
  if (!is_late) return expect(rank, "execute", wanted, code);
  int wrong = 0;
  if (code != VDI_CATALYST_OK) wrong = expect(rank, "a call after a frame that fails", 1, has_failed);
  if (code != VDI_CATALYST_OK) is_untold = 0;
  if (wanted != VDI_CATALYST_OK) has_failed = is_untold = 1;
  return wrong;
}

static int expect_end(int rank, int code) {
  if (!has_failed) return expect(rank, "finalize", VDI_CATALYST_OK, code);
  return is_untold ? expect(rank, "finalize after a frame that fails", 1, code != VDI_CATALYST_OK) : 0;
}

#endif
