/* User-mode Linux on processors whose registers do not fit into its buffers.
 *
 * User-mode Linux up to 6.12 keeps a process's floating-point registers in a buffer of fixed size. Where the processor has
 * more (AVX-512, AMX), reading them with ptrace(2) is cut off, and writing them back is refused by the host, so that the
 * guest ends with "put_fp_registers failed" before it has begun. This library stands before ptrace: it keeps what was cut
 * off beside the address of the buffer, and writes back the whole. Preloaded by tests/with-vcan.
 *
 * A state is found again by its buffer and by what the buffer held: the last states of a buffer are kept, because a signal's
 * return puts an earlier one back. A state that was never read (a new process, whose state is a copy of its parent's) is
 * written without the wide registers: the parent was in a system call, over which nobody expects them to last.
 */
#include <elf.h>
#include <errno.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

enum { WHOLE = 16384, BUFFERS = 1024, HISTORY = 4 };
enum { COMPONENTS = 512, LEGACY = 512 + 64, WITH_AVX = LEGACY + 256 }; /* offsets in an XSAVE area, Intel SDM 1, 13.4 */

struct state {
    size_t seen; /* bytes of it that the guest's kernel holds; 0: empty */
    unsigned char bytes[WHOLE];
};

static struct buffer {
    void *address;
    unsigned long used;
    unsigned newest;
    struct state states[HISTORY];
} buffers[BUFFERS];

static unsigned long now;
static size_t whole_size; /* of this processor's registers, known after the first reading */

static long call(long request, long pid, void *address, void *data) {
    return syscall(SYS_ptrace, request, pid, address, data);
}

static struct buffer *buffer_at(void *address) { /* its entry, else the one used longest ago */
    struct buffer *oldest = buffers;
    for (struct buffer *each = buffers; each < buffers + BUFFERS; each++) {
        if (each->address == address)
            return each;
        if (each->used < oldest->used)
            oldest = each;
    }
    memset(oldest, 0, sizeof *oldest);
    oldest->address = address;
    return oldest;
}

static long read_registers(long pid, void *kind, struct iovec *asked) {
    static unsigned char read[WHOLE];
    struct iovec whole = {read, WHOLE};
    long result = call(PTRACE_GETREGSET, pid, kind, &whole);
    if (result < 0)
        return result;
    whole_size = whole.iov_len;
    if (asked->iov_len > whole_size)
        asked->iov_len = whole_size;
    memcpy(asked->iov_base, read, asked->iov_len);
    struct buffer *buffer = buffer_at(asked->iov_base);
    buffer->used = ++now;
    buffer->newest = (buffer->newest + 1) % HISTORY;
    struct state *state = buffer->states + buffer->newest;
    state->seen = asked->iov_len;
    memcpy(state->bytes, read, whole_size);
    return result;
}

static long write_registers(long pid, void *kind, struct iovec *asked) {
    if (whole_size == 0 || asked->iov_len >= whole_size)
        return call(PTRACE_SETREGSET, pid, kind, asked);
    struct buffer *buffer = buffer_at(asked->iov_base);
    buffer->used = ++now;
    for (unsigned back = 0; back < HISTORY; back++) {
        struct state *state = buffer->states + (buffer->newest + HISTORY - back) % HISTORY;
        if (state->seen == asked->iov_len && memcmp(state->bytes, asked->iov_base, state->seen) == 0) {
            struct iovec whole = {state->bytes, whole_size};
            return call(PTRACE_SETREGSET, pid, kind, &whole);
        }
    }
    static unsigned char narrow[WHOLE];
    memset(narrow, 0, sizeof narrow);
    memcpy(narrow, asked->iov_base, asked->iov_len);
    uint64_t present;
    memcpy(&present, narrow + COMPONENTS, sizeof present);
    present &= asked->iov_len >= WITH_AVX ? 7 : 3; /* x87, SSE and AVX */
    memcpy(narrow + COMPONENTS, &present, sizeof present);
    struct iovec whole = {narrow, whole_size};
    return call(PTRACE_SETREGSET, pid, kind, &whole);
}

long ptrace(enum __ptrace_request request, ...) {
    va_list arguments;
    va_start(arguments, request);
    pid_t pid = va_arg(arguments, pid_t);
    void *address = va_arg(arguments, void *);
    void *data = va_arg(arguments, void *);
    va_end(arguments);
    if ((uintptr_t)address == NT_X86_XSTATE && request == PTRACE_GETREGSET)
        return read_registers(pid, address, data);
    if ((uintptr_t)address == NT_X86_XSTATE && request == PTRACE_SETREGSET)
        return write_registers(pid, address, data);
    if (request == PTRACE_PEEKTEXT || request == PTRACE_PEEKDATA || request == PTRACE_PEEKUSER) {
        long word; /* the system call stores it where the C library's function returns it */
        if (call(request, pid, address, &word) < 0)
            return -1;
        errno = 0;
        return word;
    }
    return call(request, pid, address, data);
}
