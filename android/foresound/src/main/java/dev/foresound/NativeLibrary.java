package dev.foresound;

import java.util.Arrays;
import java.util.List;

/** Loads libforesound, or explains why it cannot be loaded. */
final class NativeLibrary {
    /** Oldest API level that the library supports. */
    static final int OLDEST_API = 26;
    /** ABIs that the library is built for. */
    static final List<String> ABIS = Arrays.asList("arm64-v8a", "x86_64");

    private NativeLibrary() {}

    /** Loads the library; returns the reason of a failure, or null. */
    static Throwable load() {
        try {
            System.loadLibrary("foresound");
            return null;
        } catch (LinkageError | SecurityException missing) {
            return missing;
        }
    }

    /** Throws for a failure of {@link #load}. */
    static void require(Throwable missing) {
        if (missing != null) throw new UnavailableException(reason(api(), abis(), missing), missing);
    }

    /** Why a device cannot load the library, and the remedy. */
    static String reason(int api, List<String> abis, Throwable missing) {
        if (api > 0 && api < OLDEST_API) {
            return "libforesound.so needs Android 8.0 (API " + OLDEST_API + ") and this is API " + api
                    + "; run without it there, or raise minSdk";
        }
        if (!abis.isEmpty() && ABIS.stream().noneMatch(abis::contains)) {
            return "libforesound.so is built for " + ABIS + " and this device supports " + abis
                    + "; run without it there, or add the ABI to cargo-ndk.toml";
        }
        return "libforesound.so cannot be loaded: " + missing.getMessage()
                + "; check that the APK has it under lib/ and that no abiFilters or splits exclude it";
    }

    /** API level of this Android; 0 elsewhere. By reflection, because a host has no such class. */
    private static int api() {
        try {
            return Class.forName("android.os.Build$VERSION").getField("SDK_INT").getInt(null);
        } catch (ReflectiveOperationException host) {
            return 0;
        }
    }

    /** ABIs that this Android supports; none elsewhere. */
    private static List<String> abis() {
        try {
            return Arrays.asList((String[]) Class.forName("android.os.Build").getField("SUPPORTED_ABIS").get(null));
        } catch (ReflectiveOperationException host) {
            return List.of();
        }
    }
}
