/* A wall, set and armed by a processor beside the axis, over the AXI4-Lite bus of axi.v. C99, no library.
 *
 * `axis` is the address at which the bus of axi.v begins; registers.h is the one that `hardwall verilog` wrote with it.
 * The bus answers a refused store with an error, which most processors raise as a fault. So this code asks first.
 */
#include <stdint.h>

#include "registers.h"

#ifndef LOAD32
#define LOAD32(axis, offset) (*(volatile uint32_t *)((axis) + (offset)))
#define STORE32(axis, offset, word) (*(volatile uint32_t *)((axis) + (offset)) = (word))
#define STORE16(axis, offset, half) (*(volatile uint16_t *)((axis) + (offset)) = (half))
#endif

/* Show the supervisor that the program lives. While the axis is armed, beat again before the time of the word
 * supervisor_watchdog is over, less 1 ms. */
void axis_beat(volatile uint8_t *axis)
{
    uint32_t last = LOAD32(axis, HARDWALL_HEARTBEAT_OFFSET);

    STORE32(axis, HARDWALL_HEARTBEAT_OFFSET, (last + 1) & HARDWALL_HEARTBEAT_MAX);
}

/* Leave TRIPPED; return the causes, masks HARDWALL_CAUSE_..., or 0 if the axis was not tripped. Without effect while a
 * cause is still there. */
uint32_t axis_acknowledge(volatile uint8_t *axis)
{
    uint32_t causes;

    if (LOAD32(axis, HARDWALL_STATE_OFFSET) != HARDWALL_STATE_TRIPPED)
        return 0;
    causes = LOAD32(axis, HARDWALL_LATCHED_OFFSET);
    STORE32(axis, HARDWALL_ACKNOWLEDGED_OFFSET, causes);
    STORE16(axis, HARDWALL_ACKNOWLEDGE_OFFSET, 1);
    return causes;
}

/* Move the wall, both words at one sample; return whether they are in range. Units: HARDWALL_WALL_..._LSB. */
int axis_wall(volatile uint8_t *axis, int32_t position, int32_t stiffness)
{
    if (position < HARDWALL_WALL_POSITION_MIN || position > HARDWALL_WALL_POSITION_MAX
        || stiffness < HARDWALL_WALL_STIFFNESS_MIN || stiffness > HARDWALL_WALL_STIFFNESS_MAX)
        return 0;
    STORE32(axis, HARDWALL_WALL_POSITION_OFFSET, (uint32_t)position);
    STORE32(axis, HARDWALL_WALL_STIFFNESS_OFFSET, (uint32_t)stiffness);
    STORE16(axis, HARDWALL_COMMIT_OFFSET, 1);
    return 1;
}

/* Arm; return whether the axis is armed. `ready` needs a beat, a closed loop at drive_enable, and no cause. */
int axis_arm(volatile uint8_t *axis)
{
    axis_beat(axis);
    if (!LOAD32(axis, HARDWALL_READY_OFFSET))
        return 0;
    STORE16(axis, HARDWALL_ARM_OFFSET, 1);
    return LOAD32(axis, HARDWALL_STATE_OFFSET) == HARDWALL_STATE_ARMED;
}

/* Return the drive that is let out, in HARDWALL_DRIVEN_LSB newtons. */
int32_t axis_driven(volatile uint8_t *axis)
{
    return (int32_t)LOAD32(axis, HARDWALL_DRIVEN_OFFSET);
}
