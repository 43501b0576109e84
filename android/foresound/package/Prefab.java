import java.io.IOException;
import java.nio.ByteBuffer;
import java.nio.ByteOrder;
import java.nio.file.DirectoryStream;
import java.nio.file.Files;
import java.nio.file.Path;
import java.nio.file.StandardCopyOption;
import java.util.List;
import java.util.Map;
import java.util.TreeMap;

/**
 * Writes the AAR's prefab package: the header and the shared library of each ABI, for CMake's {@code find_package}. The
 * Android plugin makes such packages of its own native builds only. Run as a source file by build.gradle.kts and check.sh:
 *
 * <pre>java Prefab.java OUT HEADERS JNI_LIBS VERSION API NDK_VERSION</pre>
 */
final class Prefab {
    private static final String MODULE = "foresound";
    private static final String LIBRARY = "lib" + MODULE;
    /** ELF machine and class by ABI. */
    private static final Map<String, int[]> MACHINES = Map.of(
            "arm64-v8a", new int[] {183, 2},
            "x86_64", new int[] {62, 2},
            "armeabi-v7a", new int[] {40, 1},
            "x86", new int[] {3, 1});

    public static void main(String[] words) throws IOException {
        if (words.length != 6) throw new IllegalArgumentException("usage: OUT HEADERS JNI_LIBS VERSION API NDK_VERSION");
        Path out = Path.of(words[0]);
        Path headers = Path.of(words[1]);
        Map<String, Path> libraries = libraries(Path.of(words[2]));
        int api = Integer.parseInt(words[4]);
        int ndk = Integer.parseInt(words[5].split("\\.")[0]);

        remove(out);
        Path module = out.resolve("modules").resolve(MODULE);
        Files.createDirectories(module.resolve("include"));
        try (DirectoryStream<Path> files = Files.newDirectoryStream(headers, "*.h")) {
            for (Path file : files) copy(file, module.resolve("include").resolve(file.getFileName().toString()));
        }
        if (!Files.exists(module.resolve("include").resolve(MODULE + ".h"))) throw new IOException("no header in " + headers);
        write(out.resolve("prefab.json"), "{\"schema_version\":2,\"name\":\"" + MODULE + "\",\"version\":\""
                + version(words[3]) + "\",\"dependencies\":[]}");
        write(module.resolve("module.json"), "{\"export_libraries\":[],\"library_name\":\"" + LIBRARY + "\"}");
        for (Map.Entry<String, Path> library : libraries.entrySet()) {
            Path folder = module.resolve("libs").resolve("android." + library.getKey());
            Files.createDirectories(folder);
            copy(library.getValue(), folder.resolve(LIBRARY + ".so"));
            // The interface is C, and C++ inside is linked statically and hidden: any STL of the app fits.
            write(folder.resolve("abi.json"), "{\"abi\":\"" + library.getKey() + "\",\"api\":" + api + ",\"ndk\":" + ndk
                    + ",\"stl\":\"none\",\"static\":false}");
        }
        System.out.println("prefab " + MODULE + " " + version(words[3]) + ": " + String.join(", ", libraries.keySet()));
    }

    /** CMake takes numbers and dots. */
    private static String version(String cargo) {
        String numbers = cargo.split("[-+]")[0];
        if (!numbers.matches("\\d+(\\.\\d+){1,3}")) throw new IllegalArgumentException("no version: " + cargo);
        return numbers;
    }

    private static Map<String, Path> libraries(Path folder) throws IOException {
        Map<String, Path> found = new TreeMap<>();
        try (DirectoryStream<Path> abis = Files.newDirectoryStream(folder, Files::isDirectory)) {
            for (Path abi : abis) {
                Path library = abi.resolve(LIBRARY + ".so");
                if (!Files.exists(library)) continue;
                String name = abi.getFileName().toString();
                int[] machine = MACHINES.get(name);
                if (machine == null) throw new IOException("no such ABI: " + name);
                byte[] head = new byte[20];
                try (var in = Files.newInputStream(library)) {
                    if (in.readNBytes(head, 0, head.length) != head.length) throw new IOException("too short: " + library);
                }
                ByteBuffer elf = ByteBuffer.wrap(head).order(ByteOrder.LITTLE_ENDIAN);
                boolean fits = elf.getInt(0) == 0x464c457f && elf.get(4) == machine[1] && elf.getShort(18) == machine[0];
                if (!fits) throw new IOException("not a library for " + name + ": " + library);
                found.put(name, library);
            }
        }
        if (found.isEmpty()) throw new IOException("no " + LIBRARY + ".so below " + folder);
        return found;
    }

    private static void write(Path file, String json) throws IOException {
        Files.writeString(file, json + "\n");
    }

    private static void copy(Path from, Path to) throws IOException {
        Files.copy(from, to, StandardCopyOption.REPLACE_EXISTING);
    }

    private static void remove(Path folder) throws IOException {
        if (!Files.exists(folder)) return;
        try (var all = Files.walk(folder)) {
            List<Path> deepest = all.sorted((a, b) -> b.getNameCount() - a.getNameCount()).toList();
            for (Path path : deepest) Files.delete(path);
        }
    }
}
