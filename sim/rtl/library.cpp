// The Verilated axis behind a C interface, for a compiled loop: no Python, no simulator callbacks, no allocation a
// sample. With traces its clock is toggled here; without, by `harness.v`, which is faster. Both that and `axis_ports.h`
// (the widths of the ports that are read, and the parameter ports in order) are generated beside this file.
//
// Clocks are numbered from 0, the first after reset. Edge n loads the registers that clock n + 1 sees.

#include <algorithm>
#include <cstdint>
#include <memory>

#include "Vaxis__ALL.cpp"
#include "axis_ports.h"
#include "verilated.h"
#if VM_TRACE
#include "verilated_vcd_c.h"
#endif

namespace {

struct Context {
    VerilatedContext verilated;
    Vaxis axis{&verilated, "axis"};
    int64_t clock = 0;
#if VM_TRACE
    std::unique_ptr<VerilatedVcdC> trace;  // its destructor closes the file
    double period_ps = 0;

    Context() { verilated.traceEverOn(true); }
#endif

    // Run `clocks` clocks with the inputs as they are.
    void run(int64_t clocks) {
#if VM_TRACE
        for (; clocks > 0; --clocks) {
            for (int level : {1, 0}) {
                axis.clk = level;
                axis.eval();
                if (trace) trace->dump(static_cast<uint64_t>((clock + 0.5 * !level) * period_ps));
            }
            ++clock;
        }
#else
        // The harness clocks itself: one evaluation of the inputs serves them all, up to what Verilator iterates.
        while (clocks > 0) {
            const int64_t some = std::min<int64_t>(clocks, 1 << 28);
            axis.clocks = some;
            axis.go = !axis.go;
            axis.eval();
            clock += some;
            clocks -= some;
        }
#endif
    }
};

int64_t extend(uint64_t word, int width) {
    return static_cast<int64_t>(word << (64 - width)) >> (64 - width);
}

}  // namespace

extern "C" {

// A reset axis with the encoder's pins at `level`, its run-time parameters `words` committed, and the drive enabled.
void* axis_open(int64_t level, const int64_t* words) {
    auto* context = new Context;
    Vaxis& axis = context->axis;
    axis.rst = 1;
    axis.encoder_a = level & 1;
    axis.encoder_b = level >> 1 & 1;
    axis.encoder_z = 0;
    axis.drive_enable = 1;
    axis.clear_flags = axis.preload = axis.preload_count = axis.index_arm = axis.commit = 0;
#define WORD(index, name) axis.name = words[index];
    AXIS_WORDS
#undef WORD
    context->run(2);
    // Committed at the first strobe, the parameters hold from the first sample on.
    axis.rst = 0;
    axis.commit = 1;
    context->clock = 0;
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
        default:
            return context.axis.flags;
    }
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

}  // extern "C"
