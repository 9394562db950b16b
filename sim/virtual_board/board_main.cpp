// Runs the top of a board, with a file descriptor at the other end of its serial line.
//
//   board FD CLOCKS_PER_BIT CLOCKS_PER_SECOND QUIET WAIT [VALUES [HEARD FRAMES]]
//
// What arrives at FD is sent to `rx`, 8 data bits, no parity, one stop bit; what `tx` sends is written to FD. At most
// CLOCKS_PER_SECOND clocks are simulated in a second, or as many as can be if it is 0. After QUIET clocks without
// a bit on the line, the clock stops until a byte arrives. With a QUIET of 0 it begins with the first byte, and does not
// stop: the board measures by itself, with converters that give what is in the file VALUES. With WAIT, the clock also stops behind every frame from the
// board, for that many milliseconds or until a byte arrives, so that the host seems to answer at once. Ends when the
// other side of FD is closed, and prints the number of clocks, of bytes that were sent to the board, and of bytes from it.
// What DACs get is written to the file HEARD; if FRAMES is not 0, it begins at once, and ends with that frame or sample.
#include "Vtop.h"
#include "pins.h"
#include "verilated.h"

#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fcntl.h>
#include <memory>
#include <poll.h>
#include <unistd.h>
#include <vector>

namespace {

constexpr int kBits = 10;               // of a byte, with start and stop bit
constexpr size_t kRoom = 1 << 12;       // bytes that one reading takes
constexpr size_t kMostWaiting = 1 << 20;  // bytes that nobody reads before the rest is lost
constexpr uint64_t kPace = 4096;        // clocks between two looks at the time

double now() {
    timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

// Bytes from the file descriptor, as bits on `rx`.
class Sender {
public:
    Sender(int fd, double per_bit) : fd_(fd), per_bit_(per_bit) {}

    bool closed() const { return closed_; }
    uint64_t bytes() const { return sent_; }
    bool waiting() const { return next_ < bytes_.size(); }
    bool busy() const { return sending_ || waiting(); }

    // The level of the line in the next clock.
    bool level() {
        if (!sending_) {
            if (next_ >= bytes_.size()) return true;
            frame_ = (1u << 9) | (uint32_t(bytes_[next_++]) << 1);
            sending_ = true;
            ++sent_;
            clock_ = 0;
        }
        const bool level = (frame_ >> int(double(clock_) / per_bit_)) & 1;
        sending_ = double(++clock_) < kBits * per_bit_;
        return level;
    }

    // Take what has arrived, if everything before has been sent.
    void refill() {
        if (waiting()) return;
        bytes_.resize(kRoom);
        const ssize_t count = read(fd_, bytes_.data(), kRoom);
        bytes_.resize(count > 0 ? size_t(count) : 0);
        next_ = 0;
        if (count == 0 || (count < 0 && errno != EAGAIN && errno != EINTR)) closed_ = true;
    }

private:
    int fd_;
    double per_bit_;
    bool sending_ = false, closed_ = false;
    uint64_t clock_ = 0, sent_ = 0;
    uint32_t frame_ = 0;
    size_t next_ = 0;
    std::vector<uint8_t> bytes_;
};

// Bits on `tx`, as bytes to the file descriptor. A byte with a wrong stop bit is left out.
class Receiver {
public:
    Receiver(int fd, double per_bit) : fd_(fd), per_bit_(per_bit) {}

    bool busy() const { return receiving_ || !bytes_.empty(); }

    uint64_t bytes() const { return received_; }

    // Take the level of the line in this clock; tell whether it ends a frame.
    bool take(bool level) {
        if (!receiving_) {
            if (level) return false;
            receiving_ = true;
            clock_ = 0;
            bit_ = 1;
            byte_ = 0;
            return false;
        }
        if (double(++clock_) < (bit_ + 0.5) * per_bit_) return false;  // the middle of a bit
        if (bit_ < kBits - 1) {
            byte_ |= uint32_t(level) << (bit_ - 1);
            ++bit_;
            return false;
        }
        receiving_ = false;
        ++received_;
        if (level && bytes_.size() < kMostWaiting) bytes_.push_back(uint8_t(byte_));
        const bool ends = byte_ == 0 && inside_;
        inside_ = byte_ != 0;
        if (ends) flush();
        return ends;
    }

    // Write what has been received; what the other side does not take stays.
    void flush() {
        if (bytes_.empty()) return;
        const ssize_t count = write(fd_, bytes_.data(), bytes_.size());
        if (count > 0) bytes_.erase(bytes_.begin(), bytes_.begin() + count);
    }

private:
    int fd_;
    double per_bit_;
    bool receiving_ = false, inside_ = false;
    uint64_t clock_ = 0, received_ = 0;
    int bit_ = 0;
    uint32_t byte_ = 0;
    std::vector<uint8_t> bytes_;
};

}  // namespace

int main(int argc, char** argv) {
    Converters converters;
    FILE* heard = argc > 7 ? std::fopen(argv[7], "w") : nullptr;
    if (argc < 6 || (argc > 6 && !converters.load(argv[6])) || (argc > 7 && (argc < 9 || !heard))) {
        std::fprintf(stderr, "usage: board FD CLOCKS_PER_BIT CLOCKS_PER_SECOND QUIET WAIT [VALUES [HEARD FRAMES]]\n");
        return 2;
    }
    converters.audio.record(converters.dac_count ? nullptr : heard);
    converters.dacs.record(heard);
    const uint64_t frames = argc > 8 ? std::strtoull(argv[8], nullptr, 10) : 0;
    const int fd = std::atoi(argv[1]);
    const double per_bit = std::atof(argv[2]);
    const double per_second = std::atof(argv[3]);
    const uint64_t quiet = std::strtoull(argv[4], nullptr, 10);
    const int wait = std::atoi(argv[5]);
    fcntl(fd, F_SETFL, fcntl(fd, F_GETFL) | O_NONBLOCK);

    VerilatedContext context;
    const std::unique_ptr<Vtop> board(new Vtop(&context));
    Sender sender(fd, per_bit);
    Receiver receiver(fd, per_bit);
    board->rst = 0;
    board->rx = 1;
    const uint64_t turn = uint64_t(kBits * per_bit);  // a byte
    uint64_t clocks = 0, silent = 0, paced = 0;
    if (quiet == 0 && frames == 0) {
        pollfd byte{fd, POLLIN, 0};
        poll(&byte, 1, -1);
    }
    const auto played = [&] { return converters.dac_count ? converters.dacs.samples() : converters.audio.frames(); };
    double started = now();
    while (!sender.closed() && (frames == 0 || played() < frames)) {
        if (clocks % turn == 0) {
            sender.refill();
            receiver.flush();
        }
        board->rx = sender.level();
        board->clk = 0;
        board->eval();
        board->clk = 1;
        board->eval();
        exchange(converters, *board, 0);
        listen(converters.audio, *board, 0);
        write(converters, *board, 0);
        const bool answered = receiver.take(board->tx);
        ++clocks;
        if (answered && wait > 0 && !sender.waiting()) {
            pollfd byte{fd, POLLIN, 0};
            poll(&byte, 1, wait);
            sender.refill();
        }
        silent = sender.busy() || receiver.busy() ? 0 : silent + 1;
        if (quiet > 0 && silent > quiet) {
            pollfd waiting{fd, POLLIN, 0};
            poll(&waiting, 1, -1);
            if (!(waiting.revents & POLLIN)) break;
            silent = 0;
            started = now();
            paced = clocks;
        } else if (per_second > 0 && clocks % kPace == 0) {
            const double ahead = double(clocks - paced) / per_second - (now() - started);
            if (ahead > 0.001) {
                const timespec pause{time_t(ahead), long(1e9 * (ahead - double(time_t(ahead))))};
                nanosleep(&pause, nullptr);
            } else if (ahead < -1) {  // too slow for this rate: no debts
                started = now();
                paced = clocks;
            }
        }
    }
    board->final();
    if (heard) std::fclose(heard);
    std::printf("%llu %llu %llu\n", (unsigned long long)clocks, (unsigned long long)sender.bytes(),
                (unsigned long long)receiver.bytes());
    return 0;
}
