// Clocks of the Verilated board, of which those are left out in which it rests: see `board_resting.py`.
//
// A state is Verilator's class of the board and what is around it. Of its members, the counters, the sum of the pulses and
// what is read of the amplifier run on; the members of the monitor of the clock go round; all others rest.

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

#include "board_ports.h"
#include "members.h"

namespace {

using State = Vboard___024root;

// The address of a register by one of its names; none if Verilator keeps it by another.
#define FOUND(member)                                                        \
    template <class Root>                                                    \
    auto find_##member(Root& root, int) -> decltype(&root.member) {          \
        return &root.member;                                                 \
    }                                                                        \
    template <class Root>                                                    \
    uint64_t* find_##member(Root&, long) {                                   \
        return nullptr;                                                      \
    }
NAMES
#undef FOUND

#define SUM(some) find_around_board__DOT__board__DOT__stage__DOT__total(some, 0)
#define SUM_TO_COME(some) find___Vdly__around_board__DOT__board__DOT__stage__DOT__total(some, 0)
#define MEMBER(member) +sizeof(State::member)
constexpr size_t MEMBER_BYTES = 0 MEMBERS;
#undef MEMBER

class Resting {
   public:
    bool skips = SKIPS;
    int64_t evaluated = 0;  // of all clocks, those that were not skipped
    // Whether what a skip gives is compared, to the last bit, with what the clocks give; and how often it was, and was wrong.
    bool checks = false;
    int64_t checked = 0, wrong = 0;

    explicit Resting(Vboard& bench) : bench(bench), now(*bench.rootp), states(3) {
#define COUNTER(number, member, mask) \
    if (find_##member(now, 0)) known |= 1 << number;
        COUNTERS
#undef COUNTER
#define MEMORY(member) \
    if (auto* place = find_##member(now, 0)) leave_out(place, sizeof *place);
        MEMORIES
#undef MEMORY
        leave_out(&now.around_board__DOT__bytes, sizeof now.around_board__DOT__bytes);
        leave_out(nullptr, 0);
        // Without one of them it cannot be seen whether the board rests.
        skips = skips && known == (1 << COUNTER_COUNT) - 1 && seen() && (SUM_BITS == 0 || SUM(now));
        memories.resize(2 * memory_bytes);
    }

    // The inputs may have changed. What they change goes through the decoder, or the receiver: for speed alone it is not
    // looked at for so long whether anything rests.
    void begin() {
        kept = matched = 0;
        settle = SETTLE;
    }

    // The clock stands, or did: the monitor of the clock is elsewhere in its round, or in none.
    void forget() {
        begin();
        round_length = 0;
    }

    // Take some clocks, with the inputs as they are; return their number.
    int64_t run(int64_t clock, int64_t until) {
        if (!skips || bench.stopped) return evaluate(until - clock);
        if (matched == MATCHES) {
            const int64_t some = std::min(until - clock, until_stop() - 1) & ~int64_t{1};
            kept = matched = 0;
            if (some > 0) {
                checks ? check_skip(clock, some) : skip(clock, some);
                patience = PATIENCE, pause = PAUSE;
                return some;
            }
        }
        if (knows_round() && settle > 0) {
            const int64_t some = std::min(until - clock, settle);
            kept = matched = settle = 0;
            return evaluate(some);
        }
        // What does not rest for long is not looked at for as long.
        if (knows_round() && --patience < 0) {
            const int64_t some = std::min(until - clock, pause);
            pause = std::min(2 * pause, PAUSE << 6);
            patience = PATIENCE;
            begin();
            return evaluate(some);
        }
        see(clock);
        return 1;
    }

   private:
    static constexpr int MATCHES = 3;
    static constexpr int64_t SETTLE = 12, PATIENCE = 96, PAUSE = 32;

    Vboard& bench;
    State& now;
    // The last two states, and a third to compare; the pieces of a state without its memories; and the memories.
    struct alignas(State) Room {
        unsigned char bytes[sizeof(State)];
    };
    std::vector<Room> states;
    std::vector<std::pair<size_t, size_t>> pieces, left_out;
    std::vector<unsigned char> memories;
    size_t memory_bytes = 0;
    int known = 0, standing = 0;  // counters, a bit each
    int kept = 0, matched = 0;    // states in a row that are kept, and that were like those two clocks before
    int64_t amount = 0, step = 0;
    int64_t settle = 0, patience = PATIENCE, pause = PAUSE;
    // The members of the monitor at each clock of its round, and the clocks in a row in which they came again.
    std::vector<unsigned char> round = std::vector<unsigned char>(ROUND * MEMBER_BYTES);
    int64_t round_length = 0;

    State& state(int64_t clock) { return reinterpret_cast<State&>(states[clock & 1]); }
    State& compared() { return reinterpret_cast<State&>(states[2]); }

    // Leave a member out of `pieces`; with nullptr at last, make them.
    void leave_out(void* member, size_t bytes) {
        if (member) {
            left_out.emplace_back(static_cast<unsigned char*>(member) - reinterpret_cast<unsigned char*>(&now), bytes);
            memory_bytes += bytes;
            return;
        }
        std::sort(left_out.begin(), left_out.end());
        size_t from = 0;
        for (auto [place, size] : left_out) {
            pieces.emplace_back(from, place - from);
            from = place + size;
        }
        pieces.emplace_back(from, sizeof(State) - from);
    }

    static unsigned char* bytes_of(State& some) { return reinterpret_cast<unsigned char*>(&some); }

    void copy(State& to, State& from) {
        for (auto [place, size] : pieces) std::memcpy(bytes_of(to) + place, bytes_of(from) + place, size);
    }

    bool equal(State& one, State& other) {
        for (auto [place, size] : pieces)
            if (std::memcmp(bytes_of(one) + place, bytes_of(other) + place, size)) return false;
        return true;
    }

    void copy_memories(unsigned char* to) {
        for (auto [place, size] : left_out) {
            std::memcpy(to, bytes_of(now) + place, size);
            to += size;
        }
    }

    // Whether all is found that the rest of the board sees of the monitor of the clock.
    bool seen() {
        int found = 0;
#define EXIT(number, member) \
    if (find_##member(now, 0)) found |= 1 << number;
        EXITS
#undef EXIT
        return found == (1 << EXIT_COUNT) - 1;
    }

    // Whether the round is known: each of its states came again, and what is seen of it did not change.
    bool knows_round() const { return round_length > ROUND; }

    bool exits_equal(State& one, State& other) {
        bool same = true;
#define EXIT(number, member) \
    if (auto* value = find_##member(one, 0)) same = same && *value == *find_##member(other, 0);
        EXITS
#undef EXIT
        return same;
    }

    // The sum of the pulses, and its part below the carry.
    static int64_t total([[maybe_unused]] State& some) { return SUM_BITS ? static_cast<int64_t>(*SUM(some)) : 0; }

    // Between clocks the value that Verilator has prepared for the sum, if it does so, is the sum.
    static void set_total([[maybe_unused]] State& some, [[maybe_unused]] int64_t value) {
#if SUM_BITS
        *SUM(some) = value;
        if (auto* to_come = SUM_TO_COME(some)) *to_come = value;
#endif
    }

    static int64_t low(int64_t sum) { return sum & ((int64_t{1} << SUM_BITS) - 1); }

    int64_t evaluate(int64_t clocks) {
        const int64_t some = std::min<int64_t>(clocks, 1 << 28);
        bench.clocks = some;
        bench.go = !bench.go;
        bench.eval();
        evaluated += some;
        if (some != 1 && !knows_round()) round_length = 0;
        return some;
    }

    // The clocks until a counter that runs is at a stop.
    int64_t until_stop() {
        uint64_t clocks = 1 << 28;
#define STOP(number, member, mask, stop)   \
    if (!(standing & 1 << number))         \
        if (auto* value = find_##member(now, 0)) clocks = std::min<uint64_t>(clocks, (stop - *value) & mask);
        STOPS
#undef STOP
        return clocks;
    }

    // Return whether each counter has run on or stood in the last clock, as it did in those before, away from its stops.
    bool counted(State& before) {
        int stood = 0, ran = 0;
#define COUNTER(number, member, mask)                                                            \
    if (auto* value = find_##member(now, 0)) {                                                   \
        const uint64_t by = (*value - *find_##member(before, 0)) & mask;                         \
        if (by == 0) stood |= 1 << number;                                                       \
        if (by == 1) ran |= 1 << number;                                                         \
    }
        COUNTERS
#undef COUNTER
        if (kept == 1) standing = stood;
#define STOP(number, member, mask, stop) \
    if (!(standing & 1 << number))       \
        if (auto* value = find_##member(now, 0)) if (*value == stop || *find_##member(before, 0) == stop) return false;
        STOPS
#undef STOP
        return stood == standing && (stood ^ ran) == known && !(stood & ran);
    }

    // Return whether the amplifier has got what it did in the clocks before: a step a clock, or a step a pulse.
    bool summed(State& before) {
        const int64_t got = static_cast<int64_t>(now.given - before.given);
#if SUM_BITS
        // A clock gives the step of the state before it; the pulse is an output, so states with another are not alike.
        const int64_t added = total(now) - low(total(before));
        if (kept == 1) amount = added, step = static_cast<int32_t>(bench.pulse);
        return added == amount && static_cast<int32_t>(bench.pulse) == step &&
               got == (total(before) >> SUM_BITS ? step : 0);
#else
        if (kept == 1) step = got;
        return got == step;
#endif
    }

    // Take one clock, and find whether the board rests.
    void see(int64_t clock) {
        if (kept == 0) {
            copy(state(clock), now);
            kept = bench.guarded ? 0 : 1;
        }
        State& before = state(clock);
        evaluate(1);
        go_round(clock + 1, before);
        if (kept == 0) return;
        const bool like_before = !bench.guarded && counted(before) && summed(before);
        if (like_before && kept == 2) {
            State& two_before = state(clock + 1);
            copy(compared(), now);
#define COUNTER(number, member, mask) \
    if (auto* value = find_##member(compared(), 0)) *value = *find_##member(two_before, 0);
            COUNTERS
#undef COUNTER
#define MEMBER(member) std::memcpy(&compared().member, &two_before.member, sizeof now.member);
            MEMBERS
#undef MEMBER
#if SUM_BITS
            set_total(compared(), total(two_before));
#endif
            compared().given = two_before.given;
            matched = equal(compared(), two_before) ? matched + 1 : 0;
            if (matched == 1) copy_memories(memories.data());
            if (matched == MATCHES) {
                copy_memories(memories.data() + memory_bytes);
                if (std::memcmp(memories.data(), memories.data() + memory_bytes, memory_bytes)) matched = 0;
                // The memories were the same from two clocks after the first state on; they are compared again then.
                if (!knows_round()) matched = std::min(matched, MATCHES - 1);
            }
        } else if (!like_before) {
            matched = 0;
        }
        copy(state(clock + 1), now);
        kept = like_before ? 2 : bench.guarded ? 0 : 1;
    }

    // Learn the round of the monitor.
    void go_round(int64_t clock, State& before) {
        if (knows_round()) return;
        unsigned char* place = &round[clock % ROUND * MEMBER_BYTES];
        bool again = kept != 0 && exits_equal(before, now);
#define MEMBER(member)                                                         \
    again = !std::memcmp(place, &now.member, sizeof now.member) && again;      \
    std::memcpy(place, &now.member, sizeof now.member);                        \
    place += sizeof now.member;
        MEMBERS
#undef MEMBER
        round_length = again ? round_length + 1 : 0;
    }

    void check_skip(int64_t clock, int64_t some) {
        std::vector<unsigned char> before(bytes_of(now), bytes_of(now) + sizeof(State));
        skip(clock, some);
        const std::vector<unsigned char> skipped(bytes_of(now), bytes_of(now) + sizeof(State));
        std::memcpy(bytes_of(now), before.data(), sizeof(State));
        for (int64_t clocks = 0; clocks < some; ++clocks) evaluate(1);
        ++checked;
        wrong += std::memcmp(bytes_of(now), skipped.data(), sizeof(State)) != 0;
    }

    void skip(int64_t clock, int64_t some) {
#define COUNTER(number, member, mask) \
    if (!(standing & 1 << number))    \
        if (auto* value = find_##member(now, 0)) *value = (*value + some) & mask;
        COUNTERS
#undef COUNTER
        const unsigned char* place = &round[(clock + some) % ROUND * MEMBER_BYTES];
#define MEMBER(member)                                    \
    std::memcpy(&now.member, place, sizeof now.member);   \
    place += sizeof now.member;
        MEMBERS
#undef MEMBER
#if SUM_BITS
        const int64_t sum = low(total(now)) + (some - 1) * amount;
        now.given += step * ((total(now) >> SUM_BITS) + (sum >> SUM_BITS));
        set_total(now, low(sum) + amount);
#else
        now.given += step * some;
#endif
    }
};

}  // namespace
