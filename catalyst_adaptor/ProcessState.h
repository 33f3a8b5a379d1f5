/* The state of the process that belongs to the simulation. Libraries that ParaView loads, ParaView's start
 * and scripts change it. Each call of ours that may do so saves it first, and restores it at its end. Calls
 * of two handles may overlap, in two threads or one within the other: then the first one saves what belongs
 * to the whole process, and the last one restores it. */
#ifndef VDI_CATALYST_PROCESS_STATE_H
#define VDI_CATALYST_PROCESS_STATE_H

#include <fenv.h>
#include <locale.h>
#include <signal.h>

/* The part that belongs to the calling thread. */
typedef struct vdi_process_state {
  sigset_t blocked;
  stack_t signal_stack;
  fenv_t floating_point; /* traps, rounding, flags, denormal numbers */
  locale_t locale;
} vdi_process_state;

/* Saves the process's state and sets the state for our calls. The floating-point environment
 * becomes the default, because libraries perform operations that simulations trap. SIGPIPE and
 * SIGXFSZ are ignored where they would end the process. The environment gets the variables that
 * scripts have set in earlier calls. */
void vdi_process_state_save(vdi_process_state* state);

/* Restores what has changed. Keeps changed environment variables for the next call. Reports on standard error
 * what it could not restore. */
void vdi_process_state_restore(const vdi_process_state* state);

#endif
