// In an emulated board: 25 times a millisecond SysTick looks whether TIM2 has passed its compare value 4, and calls
// what stands in at_compare, as the compare interrupt would; every 25th time it is SysTick as well.

#include <string.h>

#include "py/gc.h"
#include "py/mphal.h"
#include "py/runtime.h"

size_t *allocated;
mp_obj_t at_compare;
unsigned looks_per_ms = 1;
static uint32_t vectors[128] __attribute__((aligned(512)));

void SysTick_Handler(void);

static void look(void) {
    static unsigned looks;
    if (++looks >= looks_per_ms) {
        looks = 0;
        SysTick_Handler();
    }
    if (at_compare && TIM2->DIER & TIM_DIER_CC4IE && (int32_t)(TIM2->CNT - TIM2->CCR4) >= 0) {
        nlr_buf_t before;
        mp_sched_lock();
        gc_lock();
        if (nlr_push(&before) == 0) {
            mp_call_function_0(at_compare);
            nlr_pop();
        }
        gc_unlock();
        mp_sched_unlock();
    }
}

void SystemClock_Config(void) {
    allocated = &MP_STATE_MEM(gc_alloc_amount);
    memcpy(vectors, (void *)SCB->VTOR, sizeof(vectors));
    vectors[15] = (uint32_t)look;
    SCB->VTOR = (uint32_t)vectors;
}
