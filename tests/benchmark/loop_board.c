// In an emulated board: 25 times a millisecond SysTick looks whether TIM2 has passed its compare value 4, and calls
// what stands in at_compare, as the compare interrupt would; every 25th time it is SysTick as well. While TIM2 runs, it
// also lets TIM6's interrupt come every feed_ticks; the processor knows its priority, and what stands in at_feed is called.

#include <string.h>

#include "py/gc.h"
#include "py/mphal.h"
#include "py/runtime.h"

size_t *allocated;
mp_obj_t at_compare;
mp_obj_t at_feed;
unsigned looks_per_ms = 1, feed_ticks;
static uint32_t fed, feeding;
static uint32_t (*const vectors)[128] = (void *)0x2002EE00;  // beyond the chip's memory, whose heap is the program's

void SysTick_Handler(void);

static mp_obj_t call(mp_obj_t function) {
    nlr_buf_t before;
    mp_obj_t result = mp_const_none;
    mp_sched_lock();
    gc_lock();
    if (nlr_push(&before) == 0) {
        result = mp_call_function_0(function);
        nlr_pop();
    }
    gc_unlock();
    mp_sched_unlock();
    return result;
}

static void feed(void) {
    if (mp_obj_is_true(call(at_feed))) {  // else the clock stands: again with the next look
        fed += feed_ticks;
    }
    feeding = 0;
}

static void look(void) {
    static unsigned looks;
    if (++looks >= looks_per_ms) {
        looks = 0;
        SysTick_Handler();
    }
    if (at_compare && TIM2->DIER & TIM_DIER_CC4IE && (int32_t)(TIM2->CNT - TIM2->CCR4) >= 0) {
        call(at_compare);
    }
    if (!(TIM2->CR1 & 1)) {
        fed = TIM2->CNT;
    } else if (at_feed && !feeding && TIM2->CNT - fed >= feed_ticks) {
        feeding = 1;
        NVIC_SetPendingIRQ(TIM6_DAC_IRQn);
    }
}

void SystemClock_Config(void) {
    allocated = &MP_STATE_MEM(gc_alloc_amount);
    memcpy(*vectors, (void *)SCB->VTOR, sizeof(*vectors));
    (*vectors)[16 + TIM6_DAC_IRQn] = (uint32_t)feed;
    NVIC_EnableIRQ(TIM6_DAC_IRQn);
    (*vectors)[15] = (uint32_t)look;
    SCB->VTOR = (uint32_t)vectors;
}
