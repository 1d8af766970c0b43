/* Start of a program on a Cortex-M7 in QEMU (machine mps2-an500), its standard output by semihosting. QEMU puts the
 * sections where they belong, so nothing has to be copied. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

extern char bss_start[], bss_end[], stack_top[];
extern int main(void);
extern void initialise_monitor_handles(void);

static void halt(void)
{
    abort();
}

void reset(void)
{
    volatile uint32_t *const access = (volatile uint32_t *)0xE000ED88u; /* CPACR */
    *access |= 0xFu << 20;                                              /* the floating-point unit, for all */
    __asm__ volatile("dsb\nisb");
    memset(bss_start, 0, (size_t)(bss_end - bss_start));
    initialise_monitor_handles();
    exit(main());
}

/* Initial stack, reset, and the faults, of which there may be none. */
__attribute__((section(".vectors"), used)) static void *const vectors[] = {
    stack_top, (void *)reset, (void *)halt, (void *)halt, (void *)halt, (void *)halt, (void *)halt};
