// The Verilated board with what is around it (around_board.v) behind a C interface, which has the form of the axis's: so
// the same compiled loop closes it. Its drive is what the amplifier makes of its pins: steps, the sum of a sample's clocks.
//
// Clocks are numbered from 0, the first after reset. Those in which the board rests are left out, where
// `board_resting.py` has found that this is exact; it says what is compared here, and why that is enough. `board_ports.h`
// and `members.h` name the members of Verilator's class.

#include <algorithm>
#include <cstdint>
#include <deque>

#include "Vboard__ALL.cpp"
#include "board_resting.h"
#include "verilated.h"

namespace {

// What a fault does to a wire on its way to the board.
enum Wire : int64_t { SOUND, LOW, HIGH, INVERTED };

struct Context {
    VerilatedContext verilated;
    Vboard bench{&verilated, "around_board"};
    int64_t clock = 0;
    Resting resting{bench};
    double bit_clocks = 1;

    // The handle's count, with an index every `turn` counts; and what becomes of the encoder's wires on their way.
    int64_t number = 0, turn = 1;
    Wire wires[2] = {SOUND, SOUND}, complements[2] = {SOUND, SOUND};

    // The host's bytes that wait for the line, and the byte on it: its bits, the number of the next, and when it began.
    std::deque<uint8_t> to_send;
    unsigned bits = 1;
    int next_bit = 10;
    int64_t began = 0;

    // What was read of the amplifier's sum, and of the counter of the board's bytes, which wraps.
    uint64_t given_read = 0;
    uint32_t taken = 0;

    static bool through(bool level, Wire wire) {
        return wire == SOUND ? level : wire == INVERTED ? !level : wire == HIGH;
    }

    // The pins in a count, a | b << 1, as the encoder of the world has them.
    static int64_t level_of(int64_t number) {
        const int64_t quarter = number + 1 & 3;
        return quarter ^ quarter >> 1;
    }

    void show_encoder() {
        const int64_t level = level_of(number);
        const bool a = level & 1, b = level >> 1 & 1;
        bench.encoder_z = number % turn == 0;
        bench.encoder_a = through(a, wires[0]);
        bench.encoder_b = through(b, wires[1]);
        bench.encoder_a_n = through(!a, complements[0]);
        bench.encoder_b_n = through(!b, complements[1]);
    }

    int64_t bit_clock(int bit) const { return began + static_cast<int64_t>(bit * bit_clocks + 0.5); }

    // Put the bit that is due on the line; return the clock at which the next one is due, or `until` without one.
    int64_t serve_line(int64_t until) {
        for (;;) {
            if (next_bit == 10) {
                if (to_send.empty()) return until;
                bits = to_send.front() << 1 | 0x200;
                to_send.pop_front();
                began = std::max(clock, bit_clock(10));
                next_bit = 0;
            }
            const int64_t due = bit_clock(next_bit);
            if (due > clock) return std::min(due, until);
            bench.uart_rx = bits >> next_bit & 1;
            ++next_bit;
            if (next_bit == 10 && bit_clock(10) > clock) return std::min(bit_clock(10), until);
        }
    }

    void run(int64_t clocks) {
        resting.begin();
        for (const int64_t until = clock + clocks; clock < until;) clock += resting.run(clock, until);
    }
};

Context& at(int64_t address) { return *reinterpret_cast<Context*>(address); }

}  // namespace

extern "C" {

// A reset board with the handle at a count, an index every `turn` counts, all loops closed, and a host whose bits have
// `bit_clocks` clocks.
void* board_open(int64_t number, int64_t turn, double bit_clocks) {
    auto* context = new Context;
    auto& bench = context->bench;
    context->bit_clocks = bit_clocks;
    context->began = -static_cast<int64_t>(20 * bit_clocks);
    context->number = number;
    context->turn = turn;
    context->show_encoder();
    bench.rst = bench.uart_rx = 1;
    bench.drive_enable = bench.external_fault = bench.emergency_stop = 1;
    context->run(8);
    bench.rst = 0;
    // The reset goes through a synchroniser.
    context->run(2);
    context->clock = 0;
    context->resting.forget();
    return context;
}

void board_close(void* context) { delete static_cast<Context*>(context); }

// As `axis_advance` of library.cpp, with the host's bytes beside the edges.
int64_t board_advance(int64_t address, int64_t clocks_address, int64_t levels_address, int64_t count, int64_t until) {
    Context& context = at(address);
    const auto* clocks = reinterpret_cast<const int64_t*>(clocks_address);
    const auto* levels = reinterpret_cast<const int64_t*>(levels_address);
    int64_t taken = 0;
    while (context.clock < until) {
        const int64_t before = taken;
        for (; taken < count && clocks[taken] <= context.clock; ++taken) {
            const bool upwards = levels[taken] == Context::level_of(context.number + 1);
            context.number += upwards ? 1 : -1;
        }
        if (taken != before) context.show_encoder();
        int64_t next = context.serve_line(until);
        if (taken < count) next = std::min(next, clocks[taken]);
        context.run(next - context.clock);
    }
    return taken;
}

// The sum of the amplifier's steps since the last call; nothing else is read through this interface.
int64_t board_read(int64_t address, int64_t what, int64_t, int64_t, int64_t) {
    Context& context = at(address);
    if (what != 0) return 0;
    const uint64_t before = context.given_read;
    context.given_read = context.bench.given;
    return static_cast<int64_t>(context.given_read - before);
}

// Return whether both gates of a leg of the bridge have been on together.
int64_t board_shot(void* address) { return static_cast<Context*>(address)->bench.shot; }

void board_send(void* address, const uint8_t* bytes, int64_t count) {
    auto& waiting = static_cast<Context*>(address)->to_send;
    waiting.insert(waiting.end(), bytes, bytes + count);
}

// Return how many bytes of the host wait for the line.
int64_t board_waiting(void* address) { return static_cast<Context*>(address)->to_send.size(); }

// Take at most `room` bytes that the board has sent; return their number.
int64_t board_take(void* address, uint8_t* bytes, int64_t room) {
    auto& context = *static_cast<Context*>(address);
    int64_t count = 0;
    for (; count < room && context.taken != context.bench.heard; ++count) {
        context.bench.heard_index = context.taken++ & 1023;
        context.bench.eval();
        bytes[count] = context.bench.heard_byte;
    }
    return count;
}

// Set what becomes of a wire of the encoder: 0 and 1 are A and B, 2 and 3 their complements.
void board_wire(void* address, int64_t number, int64_t wire) {
    auto& context = *static_cast<Context*>(address);
    (number < 2 ? context.wires[number] : context.complements[number - 2]) = static_cast<Wire>(wire);
    context.show_encoder();
}

// Close or open a loop: 0 drive_enable, 1 external_fault, 2 emergency_stop; or let the clock go on or stand: 3.
void board_switch(void* address, int64_t number, int64_t on) {
    auto& bench = static_cast<Context*>(address)->bench;
    if (number == 0) bench.drive_enable = on;
    if (number == 1) bench.external_fault = on;
    if (number == 2) bench.emergency_stop = on;
    if (number == 3 && bench.stopped != !on) {
        bench.stopped = !on;
        static_cast<Context*>(address)->resting.forget();
    }
}

// Evaluate every clock from here on.
void board_skip_nothing(void* address) { static_cast<Context*>(address)->resting.skips = false; }

// Compare each skip with its clocks from here on, or return how many were compared, or how many of them were wrong.
int64_t board_checked(void* address, int64_t what) {
    auto& resting = static_cast<Context*>(address)->resting;
    resting.checks = true;
    return what ? resting.wrong : resting.checked;
}

// Return how many clocks were evaluated, of all that have passed.
int64_t board_evaluated(void* address) { return static_cast<Context*>(address)->resting.evaluated; }

}  // extern "C"
