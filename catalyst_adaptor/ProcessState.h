/* What belongs to the simulation's process as a whole and not to us: libraries that ParaView loads,
 * ParaView's start and scripts change it. Each call that may do so saves it first and restores it at its end.
 */
#ifndef VDI_CATALYST_PROCESS_STATE_H
#define VDI_CATALYST_PROCESS_STATE_H

#include <fenv.h>
#include <locale.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/types.h>

enum { VDI_SIGNALS = 65 };

typedef struct vdi_process_state {
  struct sigaction actions[VDI_SIGNALS]; /* by signal; [0] isn't used */
  sigset_t blocked;                      /* of this thread */
  stack_t signal_stack;                  /* of this thread */
  fenv_t floating_point;                 /* of this thread: traps, rounding, flags, denormal numbers */
  locale_t thread_locale;
  char* locale;       /* null: unknown, for want of memory */
  char** environment; /* null-terminated copies; null: unknown, for want of memory */
  int folder;         /* a descriptor; -1: unknown */
  mode_t umask;
  struct rlimit limits[RLIM_NLIMITS];
} vdi_process_state;

/* Saves the process's state and makes that of the calls: the default floating-point environment, since what
 * simulations trap is ordinary in libraries; no end by SIGPIPE where the simulation has no handler for it;
 * and the environment variables that scripts set in the calls before. */
void vdi_process_state_save(vdi_process_state* state);

/* Restores what differs from `state`, and frees what that holds. Environment variables that differ are kept
 * for the next call. Says on standard error what could not be restored. */
void vdi_process_state_restore(vdi_process_state* state);

#endif
