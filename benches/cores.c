/* A plugin for qemu's user mode that writes what an estimate of a core's time needs: gcc -O2 -shared -fPIC -o cores.so cores.c.
   Arguments, as `cores.so,KEY=VALUE`: out (prefix of the samples' files), first, every, length (instructions before the first
   sample, from one to the next, in one), l1, l1_ways, l2, l2_ways (bytes and ways of the data caches; the instruction cache is as
   large as l1), arm (1 for aarch64, 0 for x86-64).
   A sample is what the program executes in a row, one instruction a line in hexadecimal bytes, for `llvm-mc --disassemble`. At the
   end it prints instructions, misses of the three caches and mispredicted branches. Caches are least-recently-used, without
   prefetch; branches are predicted by address and the last 16 outcomes, returns by a stack. One thread only. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef uint64_t qemu_plugin_id_t;
typedef uint32_t qemu_plugin_meminfo_t;
typedef struct qemu_info_t qemu_info_t;
struct qemu_plugin_tb;
struct qemu_plugin_insn;
enum qemu_plugin_cb_flags { QEMU_PLUGIN_CB_NO_REGS };
enum qemu_plugin_mem_rw { QEMU_PLUGIN_MEM_R = 1, QEMU_PLUGIN_MEM_W, QEMU_PLUGIN_MEM_RW };
extern void qemu_plugin_register_vcpu_tb_trans_cb(qemu_plugin_id_t,
                                                  void (*)(qemu_plugin_id_t, struct qemu_plugin_tb *));
extern void qemu_plugin_register_vcpu_tb_exec_cb(struct qemu_plugin_tb *, void (*)(unsigned, void *),
                                                 enum qemu_plugin_cb_flags, void *);
extern void qemu_plugin_register_vcpu_mem_cb(struct qemu_plugin_insn *,
                                             void (*)(unsigned, qemu_plugin_meminfo_t, uint64_t, void *),
                                             enum qemu_plugin_cb_flags, enum qemu_plugin_mem_rw, void *);
extern void qemu_plugin_register_atexit_cb(qemu_plugin_id_t, void (*)(qemu_plugin_id_t, void *), void *);
extern size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb *);
extern struct qemu_plugin_insn *qemu_plugin_tb_get_insn(const struct qemu_plugin_tb *, size_t);
extern const void *qemu_plugin_insn_data(const struct qemu_plugin_insn *);
extern size_t qemu_plugin_insn_size(const struct qemu_plugin_insn *);
extern uint64_t qemu_plugin_insn_vaddr(const struct qemu_plugin_insn *);

__attribute__((visibility("default"))) int qemu_plugin_version = 1;

enum { LINE_BITS = 6, TABLE = 1 << 16, STACK = 32, LONGEST = 16 };

/* A block as translated: instructions that run in a row. */
struct block {
    uint64_t start, end;
    size_t count;
    int calls, returns, repeats;
    struct { uint8_t size, bytes[LONGEST - 1]; } instructions[];
};

struct cache {
    uint64_t *lines; /* by set, the latest first; line numbers plus one */
    uint64_t sets, ways, misses;
};

static char prefix[4096];
static uint64_t first, every = 1, length = 1000, arm = 1;
static uint64_t sizes[2] = {65536, 524288}, ways[2] = {4, 8};
static struct cache data, code, second;
static uint64_t executed, mispredicted, history, samples, left;
static struct outcome { uint64_t of, next; } outcomes[2][TABLE];
static uint64_t stack[STACK], depth;
static const struct block *before;
static FILE *sample;

static void make(struct cache *cache, int level) {
    cache->ways = ways[level];
    cache->sets = sizes[level] / (cache->ways << LINE_BITS);
    cache->lines = calloc(cache->sets * cache->ways, sizeof *cache->lines);
}

/* Whether a line is there; it is afterwards. */
static int find(struct cache *cache, uint64_t line) {
    uint64_t *set = cache->lines + line % cache->sets * cache->ways, way = 0;
    while (way < cache->ways - 1 && set[way] != line + 1)
        way++;
    int found = set[way] == line + 1;
    memmove(set + 1, set, way * sizeof *set);
    set[0] = line + 1;
    cache->misses += !found;
    return found;
}

static void memory_is_used(unsigned cpu, qemu_plugin_meminfo_t kind, uint64_t address, void *nothing) {
    (void)cpu, (void)kind, (void)nothing;
    if (!find(&data, address >> LINE_BITS))
        find(&second, address >> LINE_BITS);
}

/* Compares where the last block went with the prediction. */
static void predict(const struct block *now) {
    if (before->returns) {
        uint64_t expected = depth ? stack[--depth % STACK] : 0;
        mispredicted += expected != now->start;
    } else {
        /* What happened last after this history, otherwise what happened last, otherwise the next instruction. */
        struct outcome *by_history = &outcomes[0][(before->start >> 2 ^ history * 0x9e37) % TABLE];
        struct outcome *last = &outcomes[1][(before->start >> 2) % TABLE];
        uint64_t expected = by_history->of == before->start ? by_history->next
                            : last->of == before->start     ? last->next
                                                            : before->end;
        mispredicted += expected != now->start;
        *by_history = *last = (struct outcome){before->start, now->start};
        history = (history << 1 | (now->start != before->end)) % TABLE;
        if (before->calls)
            stack[depth++ % STACK] = before->end;
    }
}

static void block_runs(unsigned cpu, void *data_of_block) {
    (void)cpu;
    const struct block *block = data_of_block;
    /* A string instruction of x86-64 is one, however often qemu repeats it. */
    if (block == before && block->repeats)
        return;
    executed += block->count;
    for (uint64_t line = block->start >> LINE_BITS; line <= (block->end - 1) >> LINE_BITS; line++)
        if (!find(&code, line))
            find(&second, line);
    if (before)
        predict(block);
    before = block;
    if (!sample && first && executed >= first + samples * every) {
        char name[sizeof prefix + 24];
        snprintf(name, sizeof name, "%s.%llu", prefix, (unsigned long long)samples++);
        sample = fopen(name, "w");
        left = length;
    }
    for (size_t i = 0; sample && i < block->count; i++) {
        for (int byte = 0; byte < block->instructions[i].size; byte++)
            fprintf(sample, "0x%02x ", block->instructions[i].bytes[byte]);
        fputc('\n', sample);
        if (--left == 0) {
            fclose(sample);
            sample = 0;
        }
    }
}

static void block_is_translated(qemu_plugin_id_t id, struct qemu_plugin_tb *translated) {
    (void)id;
    size_t count = qemu_plugin_tb_n_insns(translated);
    struct block *block = calloc(1, sizeof *block + count * sizeof block->instructions[0]);
    block->count = count;
    for (size_t i = 0; i < count; i++) {
        struct qemu_plugin_insn *instruction = qemu_plugin_tb_get_insn(translated, i);
        const uint8_t *bytes = qemu_plugin_insn_data(instruction);
        size_t size = qemu_plugin_insn_size(instruction);
        if (i == 0)
            block->start = qemu_plugin_insn_vaddr(instruction);
        block->end = qemu_plugin_insn_vaddr(instruction) + size;
        block->instructions[i].size = size;
        memcpy(block->instructions[i].bytes, bytes, size);
        if (arm) {
            uint32_t word;
            memcpy(&word, bytes, sizeof word);
            block->calls = word >> 26 == 0x25 || (word & 0xfffffc1f) == 0xd63f0000;
            block->returns = (word & 0xfffffc1f) == 0xd65f0000;
        } else {
            block->calls = bytes[0] == 0xe8 || (bytes[0] == 0xff && (bytes[1] >> 3 & 7) == 2) ||
                           (bytes[0] == 0x41 && bytes[1] == 0xff && (bytes[2] >> 3 & 7) == 2);
            uint8_t operation = bytes[bytes[1] == 0x48 ? 2 : 1];
            block->repeats = bytes[0] == 0xf3 && (operation == 0xa4 || operation == 0xa5 || operation == 0xaa || operation == 0xab);
            block->returns = bytes[0] == 0xc3 || (bytes[0] == 0xf3 && bytes[1] == 0xc3);
        }
        qemu_plugin_register_vcpu_mem_cb(instruction, memory_is_used, QEMU_PLUGIN_CB_NO_REGS, QEMU_PLUGIN_MEM_RW, 0);
    }
    qemu_plugin_register_vcpu_tb_exec_cb(translated, block_runs, QEMU_PLUGIN_CB_NO_REGS, block);
}

static void program_ends(qemu_plugin_id_t id, void *nothing) {
    (void)id, (void)nothing;
    fprintf(stderr, "instructions %llu data_misses %llu code_misses %llu second_misses %llu mispredicted %llu\n",
            (unsigned long long)executed, (unsigned long long)data.misses, (unsigned long long)code.misses,
            (unsigned long long)second.misses, (unsigned long long)mispredicted);
}

__attribute__((visibility("default"))) int qemu_plugin_install(qemu_plugin_id_t id, const qemu_info_t *info, int argc,
                                                               char **argv) {
    (void)info;
    struct { const char *key; uint64_t *value; } keys[] = {
        {"first", &first}, {"every", &every}, {"length", &length}, {"arm", &arm},
        {"l1", &sizes[0]}, {"l1_ways", &ways[0]}, {"l2", &sizes[1]}, {"l2_ways", &ways[1]}};
    for (int i = 0; i < argc; i++) {
        char *value = strchr(argv[i], '=');
        if (!value)
            return 1;
        *value++ = 0;
        if (!strcmp(argv[i], "out"))
            snprintf(prefix, sizeof prefix, "%s", value);
        for (size_t k = 0; k < sizeof keys / sizeof keys[0]; k++)
            if (!strcmp(argv[i], keys[k].key))
                *keys[k].value = strtoull(value, 0, 10);
    }
    make(&data, 0);
    make(&code, 0);
    make(&second, 1);
    qemu_plugin_register_vcpu_tb_trans_cb(id, block_is_translated);
    qemu_plugin_register_atexit_cb(id, program_ends, 0);
    return 0;
}
