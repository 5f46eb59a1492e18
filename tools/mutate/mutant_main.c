/* mutant_main: runs selected tests of one Unity program under selected mutants, each in a child process.
 *
 * Standard input has a line for each job: the mutant's number, the limit of loop steps, and the numbers of the tests.
 * Standard output gets "MUTANT VERDICT TEST" for each: survived, or killed by an assertion, a signal or the limit of
 * steps; and the number of the last test that ran.
 * Without a job (argument `record`): for each test its name, its loop steps, and the mutants that it reaches.
 */
#define _GNU_SOURCE /* fork, fdopen and MAP_ANONYMOUS, which -std=c11 hides */
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "mutant_count.h"
#include "unity.h"

#define MAX_TESTS   400
#define HANGS       7
#define CPU_LIMIT_S 20

int mutant_active;
unsigned long long mutant_steps, mutant_limit = ~0ull;
unsigned char mutant_reached[MUTANT_COUNT + 1];

int mutant_tests(void);
void mutant_register(const char *name, void (*test)(void));

static struct {
    const char *name;
    void (*run)(void);
} tests[MAX_TESTS];
static int count;
static int *current; /* number of the test that runs; shared with the child */

void mutant_hangs(void) {
    _exit(HANGS);
}

void mutant_register(const char *name, void (*test)(void)) {
    tests[count].name = name;
    tests[count++].run = test;
}

static int fails(int test) {
    UnityBegin("");
    UnityDefaultTestRun(tests[test].run, tests[test].name, 0);
    return Unity.TestFailures > 0;
}

static void record(void) {
    for (int test = 0; test < count; ++test) {
        fflush(stdout);
        const pid_t child = fork();
        if (child == 0) {
            FILE *const report = fdopen(dup(1), "w");
            (void)!freopen("/dev/null", "w", stdout);
            const int failed = fails(test);
            fprintf(report, "%d %s %llu %d", test, tests[test].name, mutant_steps, failed);
            for (int i = 1; i <= MUTANT_COUNT; ++i) {
                if (mutant_reached[i]) {
                    fprintf(report, " %d", i);
                }
            }
            fprintf(report, "\n");
            fflush(report);
            _exit(0);
        }
        int status = 0;
        (void)waitpid(child, &status, 0);
        if (status != 0) { /* a crash is a failure */
            printf("%d %s 0 1\n", test, tests[test].name);
        }
    }
}

static void child_runs(char *words) {
    const struct rlimit cpu = {CPU_LIMIT_S, CPU_LIMIT_S};
    (void)setrlimit(RLIMIT_CPU, &cpu);
    (void)!freopen("/dev/null", "w", stdout);
    (void)!freopen("/dev/null", "w", stderr);
    for (char *word = strtok(words, " \n"); word != NULL; word = strtok(NULL, " \n")) {
        mutant_steps = 0;
        *current = atoi(word);
        if (fails(*current)) {
            _exit(1);
        }
    }
    _exit(0);
}

int main(int argc, char **argv) {
    static char line[1 << 16];
    (void)mutant_tests();
    if ((argc > 1) && (strcmp(argv[1], "record") == 0)) {
        record();
        return 0;
    }
    current = mmap(NULL, sizeof *current, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (current == MAP_FAILED) {
        return 1;
    }
    while (fgets(line, sizeof line, stdin) != NULL) {
        char *rest = line;
        const int mutant = (int)strtol(rest, &rest, 10);
        const unsigned long long limit = strtoull(rest, &rest, 10);
        fflush(stdout);
        const pid_t child = fork();
        if (child == 0) {
            mutant_active = mutant;
            mutant_limit = limit;
            child_runs(rest);
        }
        int status = 0;
        (void)waitpid(child, &status, 0);
        const char *verdict = "survived";
        if (WIFSIGNALED(status)) {
            verdict = (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL) ? "hangs" : "signal";
        } else if (WEXITSTATUS(status) == HANGS) {
            verdict = "hangs";
        } else if (WEXITSTATUS(status) != 0) {
            verdict = "assertion";
        }
        printf("%d %s %d\n", mutant, verdict, *current);
    }
    return 0;
}
