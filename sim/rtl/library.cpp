// The Verilated axis behind a C interface, for a compiled loop: no Python, no simulator callbacks, no allocation a
// sample. With traces the top is the axis, and every clock is evaluated. Without, it is the harness around the axis, whose
// inputs are registers but for A and B: so nothing but the clock needs an evaluation. Verilator's function for what the
// clock does is called as it is, without the search for what has changed; and clocks in which the axis does nothing but
// count them are left out, where `resting.py` has found that this is exact.
//
// `harness.v` and `axis_ports.h` (the widths of the ports that are read, the parameter ports in order, and the counters)
// are generated beside this file. Clocks are numbered from 0, the first after reset. Edge n loads the registers that
// clock n + 1 sees.

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <memory>

#include "Vaxis__ALL.cpp"
#include "axis_ports.h"
#include "verilated.h"
#if VM_TRACE
#include "verilated_vcd_c.h"
#endif

namespace {

using Registers = Vaxis___024root;

// The address of a counter by one of its names; none if Verilator keeps it by another, or not at all.
#define COUNTER(member, mask)                                                      \
    template <class Root>                                                          \
    auto address_of_##member(Root& root, int) -> decltype(&root.member) {          \
        return &root.member;                                                       \
    }                                                                              \
    template <class Root>                                                          \
    uint64_t* address_of_##member(Root&, long) {                                   \
        return nullptr;                                                            \
    }
COUNTERS
#undef COUNTER

// Let the counters run for some clocks. One that has no address here is like any other register: while it runs, nothing
// rests.
void count_on([[maybe_unused]] Registers& registers, [[maybe_unused]] int64_t clocks) {
#define COUNTER(member, mask) \
    if (auto* value = address_of_##member(registers, 0)) *value = (*value + clocks) & mask;
    COUNTERS
#undef COUNTER
}

// The clocks until the first counter is at a stop.
int64_t until_stop([[maybe_unused]] Registers& registers) {
    uint64_t clocks = INT64_MAX;
#define STOP(member, mask, stop) \
    if (auto* value = address_of_##member(registers, 0)) clocks = std::min<uint64_t>(clocks, (stop - *value) & mask);
    STOPS
#undef STOP
    return clocks;
}

struct Context {
    VerilatedContext verilated;
    Vaxis axis{&verilated, "axis"};
    int64_t clock = 0;
    int64_t evaluated = 0;  // of all clocks, those that were not skipped
    bool skips = SKIPS;
    bool commits = false;  // whether words wait for the next clock to be committed
#if VM_TRACE
    std::unique_ptr<VerilatedVcdC> trace;  // its destructor closes the file
    double period_ps = 0;

    Context() { verilated.traceEverOn(true); }

    void changed() {}

    // Run `clocks` clocks with the inputs as they are.
    void run(int64_t clocks) {
        for (; clocks > 0; --clocks) {
            for (int level : {1, 0}) {
                axis.clk = level;
                axis.eval();
                if (trace) trace->dump(static_cast<uint64_t>((clock + 0.5 * !level) * period_ps));
            }
            ++clock;
            ++evaluated;
        }
    }
#else
    Registers& registers = *axis.rootp;

    // The clocks in a row, at most RESTED, in which nothing but the counters changed; what the registers should be after
    // the next if there is another; and the first clock at which it is worth to see.
    int rested = 0;
    alignas(Registers) unsigned char expected[sizeof(Registers)];
    int64_t see_from = 0;
    int64_t decoder_clocks = 0;

    void tick() {
        Vaxis___024root___eval_nba(&registers);
        ++clock;
        ++evaluated;
    }

    // Take one clock, and find whether all but the counters rests.
    void see() {
        if (rested == 0) std::memcpy(expected, static_cast<void*>(&registers), sizeof registers);
        tick();
        count_on(reinterpret_cast<Registers&>(expected), 1);
        if (std::memcmp(expected, static_cast<void*>(&registers), sizeof registers) == 0) {
            ++rested;
        } else {
            rested = 0;
            see_from = clock + 1;
        }
    }

    // The pins have changed: what they change goes through the decoder.
    void changed() {
        rested = 0;
        see_from = std::max(see_from, clock + decoder_clocks);
    }

    // Run `clocks` clocks with the inputs as they are.
    void run(int64_t clocks) {
        const int64_t until = clock + clocks;
        while (clock < until) {
            // At a stop the other registers see the counter: neither the clock that has it there nor its end is like others.
            const int64_t free = skips ? until_stop(registers) - 1 : 0;
            if (free <= 0) {
                if (free < 0) see_from = clock + SAMPLE_CLOCKS;
                rested = 0;
                tick();
            } else if (rested == RESTED) {
                const int64_t some = std::min(until - clock, free);
                count_on(registers, some);
                clock += some;
            } else if (clock >= see_from) {
                see();
            } else {
                tick();
            }
        }
    }
#endif
};

int64_t extend(uint64_t word, int width) {
    return static_cast<int64_t>(word << (64 - width)) >> (64 - width);
}

}  // namespace

extern "C" {

// A reset axis with the encoder's pins at `level`, its run-time parameters `words` committed, and the drive enabled.
// What changes at its pins has gone through its decoder after `decoder_clocks`.
void* axis_open(int64_t level, const int64_t* words, int64_t decoder_clocks) {
    auto* context = new Context;
    Vaxis& axis = context->axis;
    axis.encoder_a = level & 1;
    axis.encoder_b = level >> 1 & 1;
#define WORD(index, name) axis.name = words[index];
    AXIS_WORDS
#undef WORD
#if VM_TRACE
    axis.encoder_z = 0;
    axis.drive_enable = 1;
    axis.clear_flags = axis.preload = axis.origin_shift = axis.preload_count = axis.slip = 0;
    axis.index_arm = axis.commit = 0;
    axis.rst = 1;
    context->run(2);
    axis.rst = 0;
    context->clock = context->evaluated = 0;
#else
    // Power-up is a reset. The evaluation makes what follows from it; from here on the rising clock is all that happens.
    context->decoder_clocks = decoder_clocks;
    axis.clk = 0;
    axis.eval();
    context->registers.__VnbaTriggered[0] = 1;
#endif
    // Committed at the first strobe, the parameters hold from the first sample on.
    axis.commit = 1;
    context->run(1);
    axis.commit = 0;
    return context;
}

void axis_close(void* context) { delete static_cast<Context*>(context); }

// Run up to, not including, clock `until`, changing the pins to levels[i] (a | b << 1) from clock clocks[i] on.
// Returns how many of the `count` edges were taken: those before `until`.
int64_t axis_advance(int64_t context_address, int64_t clocks_address, int64_t levels_address, int64_t count,
                     int64_t until) {
    Context& context = *reinterpret_cast<Context*>(context_address);
    const auto* clocks = reinterpret_cast<const int64_t*>(clocks_address);
    const auto* levels = reinterpret_cast<const int64_t*>(levels_address);
    int64_t taken = 0;
    while (context.clock < until) {
        while (taken < count && clocks[taken] <= context.clock) {
            context.axis.encoder_a = levels[taken] & 1;
            context.axis.encoder_b = levels[taken] >> 1 & 1;
            ++taken;
            context.changed();
        }
        if (context.commits) {
            context.axis.commit = 1;
            context.run(1);
            context.axis.commit = 0;
            context.commits = false;
            context.changed();
            continue;
        }
        const bool more = taken < count && clocks[taken] < until;
        context.run((more ? clocks[taken] : until) - context.clock);
    }
    return taken;
}

int64_t axis_read(int64_t context_address, int64_t what, int64_t, int64_t, int64_t) {
    Context& context = *reinterpret_cast<Context*>(context_address);
    switch (what) {
        case 0:
            return extend(context.axis.drive, DRIVE_WIDTH);
        case 1:
            return extend(context.axis.velocity, VELOCITY_WIDTH);
        case 2:
            return context.axis.flags;
        case 3:
            return SAMPLED_COUNT;
        default:
            return ACCELERATION;
    }
}

// Let the surface of the wall be at another place from the next sample on: see `sim/loop/coupled.py`.
int64_t axis_move(int64_t context_address, [[maybe_unused]] int64_t position, [[maybe_unused]] int64_t velocity, int64_t,
                  int64_t) {
    Context& context = *reinterpret_cast<Context*>(context_address);
    MOVE(context.axis, position, velocity)
    context.commits = true;
    context.changed();
    return 0;
}

#if VM_TRACE
// Record a waveform from here on, until `axis_end_trace`.
void axis_trace(void* address, const char* path, double clock_hz) {
    auto& context = *static_cast<Context*>(address);
    context.period_ps = 1e12 / clock_hz;
    context.trace = std::make_unique<VerilatedVcdC>();
    context.axis.trace(context.trace.get(), 99);
    context.trace->open(path);
}

void axis_end_trace(void* address) { static_cast<Context*>(address)->trace.reset(); }
#endif

// Evaluate every clock from here on.
void axis_skip_nothing(void* address) { static_cast<Context*>(address)->skips = false; }

// Return how many clocks were evaluated since the reset, of all that have passed.
int64_t axis_evaluated(void* address) { return static_cast<Context*>(address)->evaluated; }

}  // extern "C"
