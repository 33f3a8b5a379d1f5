/* The state of the process that belongs to the simulation. Libraries that ParaView loads, ParaView's start
 * and scripts change it. Each call of ours that may do so saves it first, and restores it at its end. */
#ifndef VDI_CATALYST_PROCESS_STATE_H
#define VDI_CATALYST_PROCESS_STATE_H

#include <fenv.h>
#include <locale.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/types.h>

enum { VDI_SIGNALS = 65 };

typedef struct vdi_process_state {
  struct sigaction actions[VDI_SIGNALS]; /* by signal; [0] is unused */
  sigset_t blocked;                      /* of this thread */
  stack_t signal_stack;                  /* of this thread */
  fenv_t floating_point;                 /* of this thread: traps, rounding, flags, denormal numbers */
  locale_t thread_locale;
  char* locale;       /* null: unknown, because there was no memory */
  char** environment; /* null-terminated copies; null: no memory */
  int folder;         /* a descriptor; -1: unknown */
  mode_t umask;
  struct rlimit limits[RLIM_NLIMITS];
} vdi_process_state;

/* Saves the process's state and sets the state for our calls. The floating-point environment
 * becomes the default, because libraries perform operations that simulations trap. SIGPIPE and
 * SIGXFSZ are ignored where they would end the process. The environment gets the variables that
 * scripts have set in earlier calls. */
void vdi_process_state_save(vdi_process_state* state);

/* Restores what differs from `state`, and frees the memory that it holds. Keeps changed environment variables
 * for the next call. Reports on standard error what it could not restore. */
void vdi_process_state_restore(vdi_process_state* state);

#endif
