package android.content;

import android.content.res.AssetManager;
import java.io.File;

/** As much of Android's class as the Kotlin face uses, for the host's tests; its assets are files of a folder. */
public class Context {
    private final File folder;

    public Context(File folder) {
        this.folder = folder;
    }

    public File getCacheDir() {
        return new File(System.getProperty("java.io.tmpdir"));
    }

    public AssetManager getAssets() {
        return new AssetManager(folder);
    }
}
