/* Times Steam Audio's simulation in one of our scenes: compiled and run by steam-audio.sh.
   Arguments: OBJ SOURCES-AND-WALK COUNT THREADS TRACER EFFECT SECONDS
   SOURCES-AND-WALK is a file of lines of three numbers: start and end of the listener's walk, then sources. TRACER is default or
   embree, EFFECT parametric or convolution. Every update moves the listener by 7 cm and casts all rays, as theirs always does: 1,024
   rays of 4 bounces. Prints the milliseconds of the fastest and of the middle update, of the same by this process's processor time,
   and microseconds of direct sound a source, by one ray and by 16 rays into a sphere of half a metre. */
#include <math.h>
#include <phonon.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { RAYS = 1024, BOUNCES = 4, SAMPLES = 16, RATE = 44100, BLOCK = 1024, MOST = 100000 };
static const float STEP_M = 0.07f, DURATION_S = 2.0f;

static void check(IPLerror error, const char *what) {
    if (error != IPL_STATUS_SUCCESS) {
        fprintf(stderr, "%s failed with %d\n", what, (int)error);
        exit(1);
    }
}

static double now_ms(clockid_t clock) {
    struct timespec time;
    clock_gettime(clock, &time);
    return time.tv_sec * 1e3 + time.tv_nsec * 1e-6;
}

static int by_size(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void *grown(void *list, size_t count, size_t size) {
    /* Doubled at powers of two. */
    if (count & (count - 1))
        return list;
    list = realloc(list, (count ? 2 * count : 1) * size);
    if (!list)
        exit(1);
    return list;
}

/* Corners and polygons, whose triangles are fans. All is one material: what a material absorbs changes no number of rays. */
static IPLStaticMeshSettings mesh_of(const char *path) {
    static IPLMaterial material = {{0.10f, 0.20f, 0.30f}, 0.05f, {0.100f, 0.050f, 0.030f}};
    IPLStaticMeshSettings mesh = {0};
    FILE *file = fopen(path, "r");
    if (!file) {
        perror(path);
        exit(1);
    }
    char line[4096];
    while (fgets(line, sizeof line, file)) {
        if (line[0] == 'v' && line[1] == ' ') {
            IPLVector3 *all = grown(mesh.vertices, mesh.numVertices, sizeof *all);
            IPLVector3 *corner = &all[mesh.numVertices++];
            mesh.vertices = all;
            if (sscanf(line + 2, "%f %f %f", &corner->x, &corner->y, &corner->z) != 3)
                exit(1);
        } else if (line[0] == 'f' && line[1] == ' ') {
            IPLint32 first = 0, last = 0, number = 0;
            for (char *word = strtok(line + 2, " \n"); word; word = strtok(0, " \n"), number++) {
                IPLint32 corner = atoi(word) - 1;
                if (number == 0)
                    first = corner;
                if (number > 1) {
                    IPLTriangle *all = grown(mesh.triangles, mesh.numTriangles, sizeof *all);
                    mesh.triangles = all;
                    all[mesh.numTriangles++] = (IPLTriangle){{first, last, corner}};
                }
                last = corner;
            }
        }
    }
    fclose(file);
    mesh.numMaterials = 1;
    mesh.materials = &material;
    mesh.materialIndices = calloc(mesh.numTriangles, sizeof *mesh.materialIndices);
    return mesh;
}

static IPLCoordinateSpace3 at(IPLVector3 position) {
    return (IPLCoordinateSpace3){{1, 0, 0}, {0, 1, 0}, {0, 0, -1}, position};
}

static IPLSimulationInputs inputs_at(IPLVector3 position, IPLOcclusionType occlusion) {
    IPLSimulationInputs inputs = {0};
    inputs.flags = IPL_SIMULATIONFLAGS_DIRECT | IPL_SIMULATIONFLAGS_REFLECTIONS;
    inputs.directFlags = IPL_DIRECTSIMULATIONFLAGS_DISTANCEATTENUATION | IPL_DIRECTSIMULATIONFLAGS_AIRABSORPTION |
                         IPL_DIRECTSIMULATIONFLAGS_OCCLUSION | IPL_DIRECTSIMULATIONFLAGS_TRANSMISSION;
    inputs.source = at(position);
    inputs.occlusionType = occlusion;
    inputs.occlusionRadius = 0.5f;
    inputs.numOcclusionSamples = SAMPLES;
    inputs.numTransmissionRays = 4;
    for (int band = 0; band < IPL_NUM_BANDS; band++)
        inputs.reverbScale[band] = 1;
    return inputs;
}

int main(int count, char **arguments) {
    if (count != 8) {
        fprintf(stderr, "arguments: OBJ SOURCES-AND-WALK COUNT THREADS TRACER EFFECT SECONDS\n");
        return 1;
    }
    int wanted = atoi(arguments[3]), threads = atoi(arguments[4]), places = 0;
    int is_embree = !strcmp(arguments[5], "embree"), is_convolution = !strcmp(arguments[6], "convolution");
    double seconds = atof(arguments[7]);
    static IPLVector3 positions[4096 + 2];
    FILE *file = fopen(arguments[2], "r");
    while (file && places < wanted + 2 &&
           fscanf(file, "%f %f %f", &positions[places].x, &positions[places].y, &positions[places].z) == 3)
        places++;
    if (places < wanted + 2) {
        fprintf(stderr, "%s has fewer than %d sources\n", arguments[2], wanted);
        return 1;
    }

    IPLContextSettings of_context = {0};
    of_context.version = STEAMAUDIO_VERSION;
    IPLContext context = 0;
    check(iplContextCreate(&of_context, &context), "iplContextCreate");
    IPLSceneSettings of_scene = {0};
    of_scene.type = is_embree ? IPL_SCENETYPE_EMBREE : IPL_SCENETYPE_DEFAULT;
    if (is_embree)
        check(iplEmbreeDeviceCreate(context, 0, &of_scene.embreeDevice), "iplEmbreeDeviceCreate");
    IPLScene scene = 0;
    check(iplSceneCreate(context, &of_scene, &scene), "iplSceneCreate");
    IPLStaticMeshSettings of_mesh = mesh_of(arguments[1]);
    IPLStaticMesh mesh = 0;
    check(iplStaticMeshCreate(scene, &of_mesh, &mesh), "iplStaticMeshCreate");
    iplStaticMeshAdd(mesh, scene);
    iplSceneCommit(scene);

    IPLSimulationSettings of_simulator = {0};
    of_simulator.flags = IPL_SIMULATIONFLAGS_DIRECT | IPL_SIMULATIONFLAGS_REFLECTIONS;
    of_simulator.sceneType = of_scene.type;
    of_simulator.reflectionType =
        is_convolution ? IPL_REFLECTIONEFFECTTYPE_CONVOLUTION : IPL_REFLECTIONEFFECTTYPE_PARAMETRIC;
    of_simulator.maxNumOcclusionSamples = SAMPLES;
    of_simulator.maxNumRays = RAYS;
    of_simulator.numDiffuseSamples = 32;
    of_simulator.maxDuration = DURATION_S;
    of_simulator.maxOrder = 1;
    of_simulator.maxNumSources = wanted;
    of_simulator.numThreads = threads;
    of_simulator.rayBatchSize = 16;
    of_simulator.samplingRate = RATE;
    of_simulator.frameSize = BLOCK;
    IPLSimulator simulator = 0;
    check(iplSimulatorCreate(context, &of_simulator, &simulator), "iplSimulatorCreate");
    iplSimulatorSetScene(simulator, scene);
    IPLSourceSettings of_source = {of_simulator.flags};
    IPLSource *sources = calloc(wanted, sizeof *sources);
    for (int i = 0; i < wanted; i++) {
        check(iplSourceCreate(simulator, &of_source, &sources[i]), "iplSourceCreate");
        iplSourceAdd(sources[i], simulator);
    }
    iplSimulatorCommit(simulator);

    static double wall[MOST], processor[MOST], direct[2][MOST];
    IPLVector3 from = positions[0], to = positions[1];
    float length_m = sqrtf(powf(to.x - from.x, 2) + powf(to.y - from.y, 2) + powf(to.z - from.z, 2));
    double began = now_ms(CLOCK_MONOTONIC);
    int updates = 0;
    for (; updates < MOST && (updates < 20 || now_ms(CLOCK_MONOTONIC) - began < 1e3 * seconds); updates++) {
        /* To and fro, from the middle. */
        float share = fmodf(0.5f + STEP_M * updates / length_m, 2);
        share = share > 1 ? 2 - share : share;
        IPLSimulationSharedInputs shared = {0};
        shared.listener = at((IPLVector3){from.x + share * (to.x - from.x), from.y + share * (to.y - from.y),
                                          from.z + share * (to.z - from.z)});
        shared.numRays = RAYS;
        shared.numBounces = BOUNCES;
        shared.duration = DURATION_S;
        shared.order = 1;
        shared.irradianceMinDistance = 1;
        iplSimulatorSetSharedInputs(simulator, of_simulator.flags, &shared);
        for (int kind = 0; kind < 2; kind++) {
            for (int i = 0; i < wanted; i++) {
                IPLSimulationInputs inputs =
                    inputs_at(positions[2 + i], kind ? IPL_OCCLUSIONTYPE_VOLUMETRIC : IPL_OCCLUSIONTYPE_RAYCAST);
                iplSourceSetInputs(sources[i], of_simulator.flags, &inputs);
            }
            double start = now_ms(CLOCK_MONOTONIC);
            iplSimulatorRunDirect(simulator);
            direct[kind][updates] = 1e3 * (now_ms(CLOCK_MONOTONIC) - start) / wanted;
        }
        double start[] = {now_ms(CLOCK_MONOTONIC), now_ms(CLOCK_PROCESS_CPUTIME_ID)};
        iplSimulatorRunReflections(simulator);
        wall[updates] = now_ms(CLOCK_MONOTONIC) - start[0];
        processor[updates] = now_ms(CLOCK_PROCESS_CPUTIME_ID) - start[1];
    }
    double *lists[] = {wall, processor, direct[0], direct[1]};
    for (int i = 0; i < 4; i++)
        qsort(lists[i], updates, sizeof(double), by_size);
    printf("%.3f %.3f %.3f %.3f %.2f %.2f\n", wall[0], wall[updates / 2], processor[0], processor[updates / 2],
           direct[0][0], direct[1][0]);

    for (int i = 0; i < wanted; i++) {
        iplSourceRemove(sources[i], simulator);
        iplSourceRelease(&sources[i]);
    }
    iplSimulatorRelease(&simulator);
    iplStaticMeshRelease(&mesh);
    iplSceneRelease(&scene);
    if (is_embree)
        iplEmbreeDeviceRelease(&of_scene.embreeDevice);
    iplContextRelease(&context);
    return 0;
}
