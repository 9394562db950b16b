// Runs the top of a board, with a file descriptor at the other end of its serial line.
//
//   board FD CLOCKS_PER_BIT CLOCKS_PER_SECOND QUIET
//
// What arrives at FD is sent to `rx`, 8 data bits, no parity, one stop bit; what `tx` sends is written to FD. At most
// CLOCKS_PER_SECOND clocks are simulated in a second, or as many as can be if it is 0. After QUIET clocks without
// a bit on the line, the clock stops until a byte arrives. Ends when the other side of FD is closed.
#include "Vtop.h"
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
    Sender(int fd, uint64_t clocks) : fd_(fd), clocks_(clocks) {}

    bool closed() const { return closed_; }
    bool busy() const { return left_ > 0 || next_ < bytes_.size(); }

    // The level of the line in the next clock.
    bool level() {
        if (left_ == 0) {
            if (next_ >= bytes_.size()) return true;
            frame_ = (1u << 9) | (uint32_t(bytes_[next_++]) << 1);
            left_ = kBits * clocks_;
        }
        const uint64_t bit = kBits - 1 - (left_ - 1) / clocks_;
        --left_;
        return (frame_ >> bit) & 1;
    }

    // Take what has arrived, if everything before has been sent.
    void refill() {
        if (next_ < bytes_.size()) return;
        bytes_.resize(kRoom);
        const ssize_t count = read(fd_, bytes_.data(), kRoom);
        bytes_.resize(count > 0 ? size_t(count) : 0);
        next_ = 0;
        if (count == 0 || (count < 0 && errno != EAGAIN && errno != EINTR)) closed_ = true;
    }

private:
    int fd_;
    uint64_t clocks_, left_ = 0;
    uint32_t frame_ = 0;
    size_t next_ = 0;
    std::vector<uint8_t> bytes_;
    bool closed_ = false;
};

// Bits on `tx`, as bytes to the file descriptor. A byte with a wrong stop bit is left out.
class Receiver {
public:
    Receiver(int fd, uint64_t clocks) : fd_(fd), clocks_(clocks) {}

    bool busy() const { return left_ > 0 || !bytes_.empty(); }

    void take(bool level) {
        if (left_ == 0) {
            if (!level) {
                left_ = kBits * clocks_ - clocks_ / 2;  // ends in the middle of the stop bit
                until_sample_ = clocks_ + clocks_ / 2;  // the middle of the first data bit
                count_ = 0;
                byte_ = 0;
            }
            return;
        }
        --left_;
        if (--until_sample_ == 0) {
            until_sample_ = clocks_;
            if (count_ < 8) {
                byte_ |= uint32_t(level) << count_;
            } else if (level && bytes_.size() < kMostWaiting) {
                bytes_.push_back(uint8_t(byte_));
            }
            if (count_++ == 8) {
                left_ = 0;
                if (byte_ == 0) flush();  // the end of a frame
            }
        }
    }

    // Write what has been received; what the other side does not take stays.
    void flush() {
        if (bytes_.empty()) return;
        const ssize_t count = write(fd_, bytes_.data(), bytes_.size());
        if (count > 0) bytes_.erase(bytes_.begin(), bytes_.begin() + count);
    }

private:
    int fd_;
    uint64_t clocks_, left_ = 0, until_sample_ = 0;
    int count_ = 0;
    uint32_t byte_ = 0;
    std::vector<uint8_t> bytes_;
};

}  // namespace

int main(int argc, char** argv) {
    if (argc != 5) {
        std::fprintf(stderr, "usage: board FD CLOCKS_PER_BIT CLOCKS_PER_SECOND QUIET\n");
        return 2;
    }
    const int fd = std::atoi(argv[1]);
    const uint64_t per_bit = std::strtoull(argv[2], nullptr, 10);
    const double per_second = std::atof(argv[3]);
    const uint64_t quiet = std::strtoull(argv[4], nullptr, 10);
    fcntl(fd, F_SETFL, fcntl(fd, F_GETFL) | O_NONBLOCK);

    VerilatedContext context;
    const std::unique_ptr<Vtop> board(new Vtop(&context));
    Sender sender(fd, per_bit);
    Receiver receiver(fd, per_bit);
    board->rst = 0;
    board->rx = 1;
    uint64_t clocks = 0, silent = 0, paced = 0;
    double started = now();
    while (!sender.closed()) {
        if (clocks % (kBits * per_bit) == 0) {
            sender.refill();
            receiver.flush();
        }
        board->rx = sender.level();
        board->clk = 0;
        board->eval();
        board->clk = 1;
        board->eval();
        receiver.take(board->tx);
        ++clocks;
        silent = sender.busy() || receiver.busy() ? 0 : silent + 1;
        if (silent > quiet) {
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
    return 0;
}
