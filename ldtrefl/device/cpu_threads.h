// A team of CPU threads that share launches (cpu_threads.py): one thread launches, the others are its helpers.
//
// A launch is a *job*, cut into slices. What the threads share is a *board*:
//
//     +-----------------------------+---------------------------+----------+------------------------------+
//     | job                         | arguments                 | finished | head of each thread's queue  |
//     | kernel, items, slices, ...  | of the kernel, in a copy  | slices   | job number << 32 | taken     |
//     +-----------------------------+---------------------------+----------+------------------------------+
//
// Each thread has a queue of slices: its own run of the job, the same in every launch, so that what one kernel wrote the
// next mostly finds in the same core's cache. A head counts the slices that were taken from its queue. A thread takes
// from its own queue first, and then steals from the others'. A queue is *closed*, and nothing can be taken from it,
// while its head has CLOSED in place of the slices taken.
//
//     the thread that launches                         every thread, the one that launches included
//
//     close   heads: old number, CLOSED    relaxed
//             fence                        seq_cst
//     write   job, arguments, finished = 0
//     open    heads: next number, 0        release -->  look    at a head: a number, an open queue      acquire
//                                                       copy    job, arguments (once for each number)
//                                                               fence                                   seq_cst
//                                                       check   the head: the same number, still open   relaxed
//                                                       take    head + 1, by compare-and-exchange       acq_rel
//                                                       run     the slice
//     wait    till finished == slices      acquire <--  count   finished + 1                            release
//
// open, look     Whoever sees a job's number sees all of the job.
// close, check   A sequence lock. While the next job is written nobody is at *run*, as the launch before waited for that,
//                but a helper may still be at *copy*. If any of its copy is of the next job, the two fences have it see a
//                closed head, or the next number, in *check*: it drops the copy.
// take           One thread gets a slice. The exchange fails if anything was taken, closed or opened since *look*, so the
//                slice belongs to the job that was copied.
// count, wait    Whoever sees all slices finished sees all that the kernel wrote.

struct ThreadTeam {
    enum : uint64_t { CLOSED = 0xffffffff };  // as a head's slices taken; and as a job's number, that of none
    enum { ARGUMENT_WORDS = MOST_ARGUMENT_BYTES / 8 };

    // A launch over ``items`` items from ``first`` on, in ``slices`` slices.
    struct Job {
        uint64_t kernel;                     // address of its code
        uint64_t arguments, argument_bytes;  // address and size, a multiple of 8; the first is an int32, the first item
        uint64_t first, items, slices;
    };

    // A number in a cache line of its own.
    struct Counter {
        uint64_t value, unused[7];
    };

    // The heads stand after it, one for each thread.
    struct Board {
        Job job;
        uint64_t arguments[ARGUMENT_WORDS];
        Counter threads, finished;
    };
    static_assert(sizeof(Board) == BOARD_BYTES, "a board as cpu_threads.py has it");

    // A thread at a board, and its copy of the job that it works at.
    struct Worker {
        Board* board;
        Counter* heads;
        uint64_t thread, threads;
        uint64_t number;  // of the job below
        Job job;
        alignas(16) uint64_t arguments[ARGUMENT_WORDS];
    };

    // Work at the jobs on a board as one of its threads. With the address of a job, put that on the board first and
    // return when it is finished. In any case return after looking ``most_looks`` times without finding a slice.
    static void work(uint64_t board_address, uint64_t job_address, uint64_t thread, uint64_t most_looks) {
        Worker worker;
        worker.board = (Board*)board_address;
        worker.heads = (Counter*)(worker.board + 1);
        worker.thread = thread;
        worker.threads = worker.board->threads.value;
        worker.number = CLOSED;
        if (job_address) publish(worker, *(const Job*)job_address);
        for (uint64_t looks = 0; looks < most_looks; ++looks) {
            for (uint64_t k = 0; k < worker.threads; ++k)
                if (empty_queue(worker, (thread + k) % worker.threads)) looks = 0;
            if (job_address && is_finished(*worker.board)) return;
            pause();
        }
    }

    // Close the board, write a job on it, open it.
    static void publish(Worker& worker, const Job& job) {
        Board& board = *worker.board;
        const uint64_t number = worker.heads[0].value >> 32;
        for (uint64_t t = 0; t < worker.threads; ++t)
            __atomic_store_n(&worker.heads[t].value, number << 32 | CLOSED, __ATOMIC_RELAXED);
        __atomic_thread_fence(__ATOMIC_SEQ_CST);
        board.job = job;
        for (uint64_t i = 0; 8 * i < job.argument_bytes; ++i)
            board.arguments[i] = ((const uint64_t*)job.arguments)[i];
        board.finished.value = 0;
        for (uint64_t t = 0; t < worker.threads; ++t)
            __atomic_store_n(&worker.heads[t].value, (number + 1) << 32, __ATOMIC_RELEASE);
    }

    static bool is_finished(const Board& board) {
        return __atomic_load_n(&board.finished.value, __ATOMIC_ACQUIRE) == board.job.slices;
    }

    // Run slices from a thread's queue until it is empty or closed: whether there were any.
    static bool empty_queue(Worker& worker, uint64_t owner) {
        uint64_t* head_address = &worker.heads[owner].value;
        uint64_t head = __atomic_load_n(head_address, __ATOMIC_ACQUIRE);
        bool has_run = false;
        while ((head & CLOSED) != CLOSED) {
            if (head >> 32 != worker.number && !copy_job(worker, head_address, head >> 32)) break;
            const Job& job = worker.job;
            const uint64_t slice = owner * job.slices / worker.threads + (head & CLOSED);
            if (slice >= (owner + 1) * job.slices / worker.threads) break;
            if (!__atomic_compare_exchange_n(head_address, &head, head + 1, false, __ATOMIC_ACQ_REL, __ATOMIC_ACQUIRE))
                continue;  // ``head`` is what stands there now
            run_slice(worker, slice);
            has_run = true;
            head = __atomic_load_n(head_address, __ATOMIC_ACQUIRE);
        }
        return has_run;
    }

    // Copy the job of this number: false if another took its place meanwhile.
    static bool copy_job(Worker& worker, const uint64_t* head_address, uint64_t number) {
        const Board& board = *worker.board;
        worker.job = board.job;
        for (uint64_t i = 0; i < ARGUMENT_WORDS && 8 * i < worker.job.argument_bytes; ++i)
            worker.arguments[i] = board.arguments[i];
        __atomic_thread_fence(__ATOMIC_SEQ_CST);
        const uint64_t now = __atomic_load_n(head_address, __ATOMIC_RELAXED);
        if (now >> 32 != number || (now & CLOSED) == CLOSED) return false;
        worker.number = number;
        return true;
    }

    static void run_slice(Worker& worker, uint64_t slice) {
        const Job& job = worker.job;
        const uint64_t begin = slice * job.items / job.slices;
        const uint64_t items = (slice + 1) * job.items / job.slices - begin;
        *(int*)worker.arguments = (int)(job.first + begin);
        Warp::call_kernel(job.kernel, items, worker.arguments);
        __atomic_fetch_add(&worker.board->finished.value, 1, __ATOMIC_RELEASE);
    }

    // Let the other thread of a core go on.
    static void pause() {
#if defined(__x86_64__)
        __builtin_ia32_pause();
#endif
    }
};
