// Several axes, Verilated, behind a C interface for a compiled loop: an encoder's edges into each of them, a drive out.
//
// `axes.v` and `axes_ports.h` (the numbers of the axes, of their words and clocks, and the widths of ports) are generated
// beside this file. Clocks are numbered from 0, the first after reset. Edge n loads the registers that clock n + 1 sees.
// As in `library.cpp`, Verilator's function for what the clock does is called as it is, once all words are written.

#include <array>
#include <cstdint>
#include <deque>

#include "Vaxes__ALL.cpp"
#include "axes_ports.h"
#include "verilated.h"

namespace {

constexpr int64_t ROTAS_KEPT = 64;  // more than a sample takes from its velocity to its drive
constexpr uint32_t ALL = AXES == 32 ? UINT32_MAX : (1u << AXES) - 1;

constexpr uint64_t mask(int width) { return width == 64 ? UINT64_MAX : (uint64_t{1} << width) - 1; }

int64_t extend(uint64_t word, int width) { return static_cast<int64_t>(word << (64 - width)) >> (64 - width); }

// Element `number` of an array in a port of at most 64 bits, or of more.
template <class Port>
uint64_t element(const Port& port, int number, int width) {
    return port >> number * width & mask(width);
}
template <std::size_t words>
uint64_t element(const VlWide<words>& port, int number, int width) {
    uint64_t value = 0;
    for (int bit = 0; bit < width; ++bit) {
        const int place = number * width + bit;
        value |= uint64_t{port[place / 32] >> place % 32 & 1} << bit;
    }
    return value;
}

struct Edge {
    int64_t clock;
    int level;
};

struct Context {
    VerilatedContext verilated;
    Vaxes axes{&verilated, "axes"};
    int64_t clock = 0;
    std::array<std::deque<Edge>, AXES> edges;
    std::array<std::array<int64_t, ROTAS_KEPT>, AXES> velocities{};
    std::array<int64_t, AXES> velocity{};  // of the sample whose drive was waited for

    // Take a clock with inputs that may have changed.
    void tick() {
        for (int level : {0, 1}) {
            axes.clk = level;
            axes.eval();
        }
        ++clock;
    }

    // From here on no input changes but A and B, which go to registers: the rising clock is all that happens.
    void settle() {
        axes.clk = 0;
        axes.eval();
        axes.rootp->__VnbaTriggered[0] = 1;
    }

    void set_pins(int axis, int level) {
        const uint32_t bit = 1u << axis;
        axes.encoder_a = (axes.encoder_a & ~bit) | (level & 1 ? bit : 0);
        axes.encoder_b = (axes.encoder_b & ~bit) | (level >> 1 & 1 ? bit : 0);
    }

    // Take a clock with the pins as they are in it, and keep the velocity that comes of it.
    void step() {
        for (int axis = 0; axis < AXES; ++axis) {
            auto& coming = edges[axis];
            for (; !coming.empty() && coming.front().clock <= clock; coming.pop_front()) {
                set_pins(axis, coming.front().level);
            }
        }
        Vaxes___024root___eval_nba(axes.rootp);
        ++clock;
        for (uint32_t left = axes.estimated, axis = 0; left; left >>= 1, ++axis) {
            if (left & 1) {
                const int64_t rota = (clock - ESTIMATED - axis) / ROTA;
                velocities[axis][rota % ROTAS_KEPT] = extend(axes.velocity, VELOCITY_WIDTH);
            }
        }
    }
};

}  // namespace

extern "C" {

// Axes after a reset with the pins of each at `levels`, its words written one a clock after the first rota, and committed
// together with a count of 0. The drives are enabled.
void* axes_open(const int64_t* levels, const int64_t* words) {
    auto* context = new Context;
    Vaxes& axes = context->axes;
    axes.encoder_a = axes.encoder_b = axes.encoder_z = 0;
    for (int axis = 0; axis < AXES; ++axis) context->set_pins(axis, static_cast<int>(levels[axis]));
    axes.drive_enable = ALL;
    axes.clear_flags = axes.preload = axes.origin_shift = axes.preload_count = axes.slip = 0;
    axes.index_arm = axes.commit = 0;
    axes.word_write = axes.word_axis = axes.word_number = axes.word_value = 0;
    axes.rst = 1;
    context->tick();
    context->tick();
    axes.rst = 0;
    context->clock = 0;
    while (context->clock < ROTA) context->tick();
    axes.word_write = 1;
    for (int place = 0; place < AXES * WORDS; ++place) {
        axes.word_axis = place / WORDS;
        axes.word_number = place % WORDS;
        axes.word_value = words[place] & mask(VALUE_WIDTH);
        context->tick();
    }
    axes.word_write = 0;
    axes.commit = axes.preload = ALL;
    context->tick();
    axes.commit = axes.preload = 0;
    context->settle();
    return context;
}

void axes_close(void* context) { delete static_cast<Context*>(context); }

// Give the next edges of an axis: its pins change to levels[i] (a | b << 1) from clock clocks[i] on.
int64_t axes_give(int64_t address, int64_t axis, int64_t clocks_address, int64_t levels_address, int64_t count) {
    const auto* clocks = reinterpret_cast<const int64_t*>(clocks_address);
    const auto* levels = reinterpret_cast<const int64_t*>(levels_address);
    auto& edges = reinterpret_cast<Context*>(address)->edges[axis];
    for (int64_t n = 0; n < count; ++n) edges.push_back({clocks[n], static_cast<int>(levels[n])});
    return count;
}

// Run up to, not including, clock `until`, at which the drive of an axis has changed; return that drive.
int64_t axes_drive(int64_t address, int64_t axis, int64_t until, int64_t, int64_t) {
    Context& context = *reinterpret_cast<Context*>(address);
    while (context.clock < until) context.step();
    const int64_t rota = (until - LATENCY - axis) / ROTA;
    context.velocity[axis] = context.velocities[axis][rota % ROTAS_KEPT];
    return extend(element(context.axes.drive, axis, DRIVE_WIDTH), DRIVE_WIDTH);
}

// Return the velocity of the sample whose drive was waited for (0), or the flags (1).
int64_t axes_read(int64_t address, int64_t axis, int64_t what, int64_t, int64_t) {
    Context& context = *reinterpret_cast<Context*>(address);
    return what ? element(context.axes.flags, axis, FLAGS_WIDTH) : context.velocity[axis];
}

}  // extern "C"
