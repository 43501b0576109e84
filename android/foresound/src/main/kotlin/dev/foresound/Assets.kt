package dev.foresound

import android.content.Context
import java.io.FileNotFoundException
import java.io.IOException
import java.io.InputStream

/** Opens one of the app's assets. Throws an [IOException] with the remedy if it is missing. */
internal fun openAsset(context: Context, name: String): InputStream = try {
    context.assets.open(name)
} catch (missing: FileNotFoundException) {
    throw IOException("the app has no asset $name; put the file under src/main/assets, or check its name", missing)
}
